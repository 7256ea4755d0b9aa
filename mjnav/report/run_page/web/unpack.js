'use strict';

/** The arrays of a run: the inverse of mjnav/report/run_page/layers.py. Each row of an array is one frame. */
class Table {
  /** @param {ArrayLike<number>} values row after row  @param {number[]} shape frames first */
  constructor(values, shape) {
    this.values = values;
    this.width = shape.slice(1).reduce((product, size) => product * size, 1);
  }

  /** The numbers of one frame. */
  row(frame) {
    return this.values.subarray(frame * this.width, (frame + 1) * this.width);
  }

  /** Column `column` as an array over all frames. */
  column(column) {
    const count = this.width ? this.values.length / this.width : 0;
    return Array.from({ length: count }, (_, frame) => this.values[frame * this.width + column]);
  }
}

const NUMBER_ARRAYS = { uint8: Uint8Array, float32: Float32Array, float64: Float64Array };

/** Sums of 16-bit changes, column by column, low bytes before high bytes. */
function measuredValues(buffer, field, length, frames) {
  const bytes = new Uint8Array(buffer, field.offset, 2 * length);
  const values = new Float32Array(length);
  const width = length / frames;
  for (let column = 0; column < width; column++) {
    let code = 0;
    for (let frame = 0; frame < frames; frame++) {
      const place = column * frames + frame;
      code = (code + bytes[place] + 256 * bytes[length + place]) & 0xffff;
      values[frame * width + column] = code === 0xffff ? NaN : field.low + field.step * code;
    }
  }
  return values;
}

/** Signed bytes as numbers; -128 is NaN. */
function offsetValues(buffer, field, length) {
  return Float32Array.from(new Int8Array(buffer, field.offset, length), (code) =>
    code === -128 ? NaN : field.step * code);
}

/** @returns {Promise<Object<string, Table>>} every array by name */
async function unpack(run) {
  const packed = Uint8Array.from(atob(run.gzip), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  const buffer = await new Response(stream).arrayBuffer();
  const tables = {};
  for (const [name, field] of Object.entries(run.fields)) {
    const length = field.shape.reduce((product, size) => product * size, 1);
    let values;
    if (field.kind === 'measured') values = measuredValues(buffer, field, length, field.shape[0]);
    else if (field.kind === 'offsets') values = offsetValues(buffer, field, length);
    else values = new NUMBER_ARRAYS[field.kind](buffer, field.offset, length);
    tables[name] = new Table(values, field.shape);
  }
  return tables;
}

/** A run with its arrays, and what is asked of them. */
class Run {
  static async load(packed, index) {
    return new Run(packed, index, await unpack(packed));
  }

  constructor(packed, index, tables) {
    Object.assign(this, packed, { index, tables, gzip: null });
    this.time = tables.time.values;
    this.last = this.time.length - 1;
  }

  /** The frame at `time`, or the last one before it. */
  frameAt(time) {
    let low = 0, high = this.last;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time + 1e-6) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** The numbers of one array at a frame; an empty row where there is no such array. */
  row(name, frame) {
    return this.tables[name] ? this.tables[name].row(frame) : [];
  }

  /** A number of one array at a frame. */
  at(name, frame, column = 0) {
    return this.row(name, frame)[column];
  }

  /** The frame whose beliefs a frame shows: its own; of the state at the end, which no tick follows, those before. */
  tickOf(frame) {
    return frame === this.last && frame > 0 && !Number.isFinite(this.at('estimate', frame)) ? frame - 1 : frame;
  }

  /** What the controller said of its decision. */
  status(frame) {
    return this.statuses[this.at('status', frame)] ?? null;
  }

  /** The obstacle whose distribution a frame has. */
  coneObstacle(frame) {
    return this.cone ? this.cone.obstacles[this.at('cone_obstacle', frame)] ?? null : null;
  }

  /** The candidates of a frame as {v, omega, level}, the costliest first, so that cheap ones are drawn above. */
  candidateArcs(frame) {
    const window = this.row('window', frame);
    if (!this.candidates || !(window[1] >= window[0])) return [];
    const level = this.row('level', frame), places = this.row('places', frame), grid = this.candidates.grid;
    const arcs = [];
    for (let i = 0; i < level.length; i++) {
      if (level[i] >= this.levels) continue;
      const shares = grid
        ? [Math.floor(i / grid[1]) / Math.max(1, grid[0] - 1), (i % grid[1]) / Math.max(1, grid[1] - 1)]
        : [places[2 * i] / 255, places[2 * i + 1] / 255];
      arcs.push({
        v: window[0] + (window[1] - window[0]) * shares[0],
        omega: window[2] + (window[3] - window[2]) * shares[1],
        level: level[i],
      });
    }
    return arcs.sort((a, b) => b.level - a.level);
  }
}

/** A number with its unit, or a dash. */
function quantity(value, digits, unit) {
  if (!Number.isFinite(value)) return '\u2013';
  const text = (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace('-', '\u2212');
  return unit ? `${text}\u202f${unit}` : text;
}

/** A number to three digits, whatever its size. */
function compact(value) {
  if (!Number.isFinite(value)) return '\u2013';
  const size = Math.abs(value);
  const far = size !== 0 && (size >= 1e4 || size < 1e-3);
  const text = far ? value.toExponential(1).replace('e+', 'e') : value.toPrecision(3);
  return text.replaceAll('-', '\u2212');
}
