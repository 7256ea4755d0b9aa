'use strict';

/* Quantities over time, one line a series; a click seeks, a line shows the moment. */

const MARGIN = { left: 44, right: 16, top: 8, bottom: 24 };
const PLOT_HEIGHT = 150; // [pixels]

/** About `count` round numbers from low to high. */
function niceTicks(low, high, count) {
  const rough = (high - low) / Math.max(1, count);
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough * 0.999);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) ticks.push(i * step);
  return ticks;
}

/** A round number without the digits that binary fractions add. */
function tickText(value) {
  const text = Number(value.toPrecision(3));
  return Math.abs(text) >= 1e4 ? text.toExponential(0).replace('e+', 'e') : String(text).replace('-', '\u2212');
}

/** Zero and powers of ten of both signs within the range, far enough apart. */
function powerTicks(low, high, place) {
  const powers = [];
  for (let exponent = -9; exponent <= 12; exponent++) powers.push(10 ** exponent, -(10 ** exponent));
  const ticks = [0];
  powers.sort((a, b) => Math.abs(b) - Math.abs(a));
  for (const tick of powers.filter((value) => value <= high && value >= low)) {
    if (ticks.every((other) => Math.abs(place(other) - place(tick)) > 17)) ticks.push(tick);
  }
  return ticks;
}

class TimePlot {
  /**
   * @param {{title: string, help: string, unit: string, digits: number, series: Array, asinh?: boolean, stacked?: boolean,
   *   level?: number, marks?: Array}} spec a series is {label, run, values, style}, values one a frame; `level` is a value
   *   that means something, a mark {time, text} a moment that does
   * @param {number} duration [s] of the time axis  @param {(time: number) => void} seek
   */
  constructor(parent, spec, duration, seek) {
    Object.assign(this, { spec, duration, seek });
    this.series = spec.series.filter((series) => series.values.some(Number.isFinite));
    if (spec.stacked) this.stack();
    const figure = document.createElement('figure');
    figure.className = 'plot';
    const caption = figure.appendChild(document.createElement('figcaption'));
    const title = caption.appendChild(document.createElement('h3'));
    title.append(Object.assign(document.createElement('span'), {
      className: 'term', tabIndex: 0, title: spec.help, textContent: spec.title,
    }));
    title.append(Object.assign(document.createElement('span'), { className: 'unit', textContent: spec.unit }));
    this.keys = caption.appendChild(document.createElement('ul'));
    this.figure = figure;
    parent.append(figure);
    if (!this.series.length) {
      figure.append(Object.assign(document.createElement('p'), { className: 'none', textContent: 'not in this log' }));
      return;
    }
    this.values = this.series.map((series) => this.key(series));
    this.root = svg(figure, 'svg', { role: 'img', 'aria-label': this.description() });
    this.root.addEventListener('pointerdown', (event) => this.drag(event));
  }

  /** Each series on top of the one before. */
  stack() {
    this.series.reduce((below, series) => {
      series.below = below;
      series.top = series.values.map((value, i) => value + (below ? below[i] : 0));
      return series.top;
    }, null);
  }

  /** An entry of the legend; returns where the value goes. */
  key(series) {
    const item = this.keys.appendChild(document.createElement('li'));
    const swatch = svg(item, 'svg', { class: 'swatch', width: 18, height: 8, 'aria-hidden': 'true' });
    if (this.spec.stacked && !series.line) svg(swatch, 'rect', { class: `area ${series.style}`, width: 18, height: 8 });
    else svg(swatch, 'line', { class: `line ${series.style}`, x1: 0, x2: 18, y1: 4, y2: 4 });
    item.append(` ${series.label} `);
    return item.appendChild(Object.assign(document.createElement('b'), { textContent: '\u2013' }));
  }

  text(value) {
    return this.spec.asinh ? compact(value) : quantity(value, this.spec.digits);
  }

  /** What the plot says, in words. */
  description() {
    const parts = this.series.map((series) => {
      const known = series.values.filter(Number.isFinite);
      const [low, high] = [Math.min(...known), Math.max(...known)];
      return `${series.label} from ${this.text(low)} to ${this.text(high)}`;
    });
    return `${this.spec.title} ${this.spec.unit} over time: ${parts.join('; ')}.`;
  }

  scales(width) {
    const tops = this.series.flatMap((series) => series.top ?? series.values).filter(Number.isFinite);
    if (this.spec.level !== undefined) tops.push(this.spec.level);
    const low = Math.min(0, ...tops);
    let high = Math.max(0, ...tops);
    const bend = this.spec.asinh ? this.bend(tops) : 0;
    const curve = bend ? (value) => Math.asinh(value / bend) : (value) => value;
    if (high - low < 1e-9) high = low + 1;
    const margin = 0.04 * (curve(high) - curve(low));
    const [bottom, top] = [curve(low) - (low < 0 ? margin : 0), curve(high) + margin];
    const floor = PLOT_HEIGHT - MARGIN.bottom;
    this.x = (time) => MARGIN.left + (time / this.duration) * (width - MARGIN.left - MARGIN.right);
    this.y = (value) => floor - ((curve(value) - bottom) / (top - bottom)) * (floor - MARGIN.top);
    this.ticks = bend ? powerTicks(low, high, this.y) : niceTicks(low, high, 4);
  }

  /** Where the axis turns from linear to logarithmic; 0 where all of it is linear. */
  bend(values) {
    const sizes = values.map(Math.abs).filter((size) => size > 0).sort((a, b) => a - b);
    const middle = sizes[Math.floor(sizes.length / 2)] ?? 0;
    return sizes[sizes.length - 1] > 8 * middle ? middle : 0;
  }

  resize() {
    if (!this.root) return;
    const { root } = this, { width } = root.getBoundingClientRect(), floor = PLOT_HEIGHT - MARGIN.bottom;
    root.replaceChildren();
    root.setAttribute('viewBox', `0 0 ${width} ${PLOT_HEIGHT}`);
    root.setAttribute('height', PLOT_HEIGHT);
    this.scales(width);
    for (const tick of this.ticks) {
      const y = this.y(tick);
      const kind = tick === 0 ? 'axis' : 'grid';
      svg(root, 'line', { class: kind, x1: MARGIN.left, x2: width - MARGIN.right, y1: y, y2: y });
      svg(root, 'text', { class: 'tick', x: MARGIN.left - 6, y: y + 4, 'text-anchor': 'end' }, tickText(tick));
    }
    const seconds = niceTicks(0, this.duration, width > 420 ? 8 : 4);
    for (const tick of seconds) {
      const x = this.x(tick), unit = tick === seconds[seconds.length - 1] ? '\u202fs' : '';
      svg(root, 'line', { class: 'grid', x1: x, x2: x, y1: floor, y2: floor + 4 });
      svg(root, 'text', { class: 'tick', x, y: floor + 16, 'text-anchor': 'middle' }, tickText(tick) + unit);
    }
    if (this.spec.level !== undefined) {
      const y = this.y(this.spec.level);
      svg(root, 'line', { class: 'level', x1: MARGIN.left, x2: width - MARGIN.right, y1: y, y2: y });
    }
    for (const { time, text } of this.spec.marks ?? []) {
      const x = this.x(time).toFixed(1);
      const mark = svg(root, 'path', { class: 'moment', d: `M${x} ${floor}l-4 7h8Z` });
      svg(mark, 'title', {}, text);
    }
    for (const series of this.series) {
      const area = this.spec.stacked && !series.line;
      svg(root, 'path', { class: `${area ? 'area' : 'line'} ${series.style}`, d: this.outline(series, area) });
    }
    this.cursorLine = svg(root, 'line', { class: 'cursor', y1: MARGIN.top, y2: floor });
    if (this.moment !== undefined) this.cursor(this.moment);
  }

  /** The path of a line or of an area down to what is below, with gaps where there is nothing. */
  outline(series, area) {
    const time = series.run.time, values = series.top ?? series.values;
    const point = (i, value) => `${this.x(time[i] - time[0]).toFixed(1)} ${this.y(value).toFixed(1)}`;
    let path = '', first = 0;
    for (let i = 0; i <= values.length; i++) {
      if (i < values.length && Number.isFinite(values[i])) {
        path += `${i === first ? 'M' : 'L'}${point(i, values[i])}`;
        continue;
      }
      if (area) {
        for (let j = i - 1; j >= first; j--) {
          path += `L${point(j, series.below ? series.below[j] : 0)}${j === first ? 'Z' : ''}`;
        }
      }
      first = i + 1;
    }
    return path;
  }

  /** Shows the moment and what the series are then. */
  cursor(moment) {
    this.moment = moment;
    if (!this.root) return;
    const x = this.x(Math.min(moment, this.duration));
    this.cursorLine.setAttribute('x1', x);
    this.cursorLine.setAttribute('x2', x);
    this.series.forEach((series, i) => {
      this.values[i].textContent = this.text(series.values[series.run.frameAt(moment + series.run.time[0])]);
    });
  }

  drag(event) {
    const seek = (to) => {
      const box = this.root.getBoundingClientRect();
      const share = (to.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
      this.seek(Math.min(1, Math.max(0, share)) * this.duration);
    };
    const end = () => {
      this.root.removeEventListener('pointermove', seek);
      this.root.removeEventListener('pointerup', end);
      this.root.removeEventListener('pointercancel', end);
    };
    this.root.setPointerCapture(event.pointerId);
    this.root.addEventListener('pointermove', seek);
    this.root.addEventListener('pointerup', end);
    this.root.addEventListener('pointercancel', end);
    seek(event);
  }
}
