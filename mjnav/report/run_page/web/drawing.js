'use strict';

/* Drawing in metres on a canvas: the view, lines, discs and words. */

/** The colour behind a CSS variable, in the theme of the moment. */
function colour(name) {
  const probe = document.getElementById('probe');
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

const AROUND = [0, 1, -1, 2, -2, 3, -3, 4]; // eighths of a turn from where a label would be best
const FOOT = 14; // [pixels] below, for the scale

class Drawing {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    Object.assign(this, { canvas, context: canvas.getContext('2d'), ink: {}, noted: [], marks: [], placed: [] });
  }

  /** Makes the canvas as wide as what it stands in, and as high as asked, in the screen's own pixels. */
  fit(width, height) {
    const ratio = window.devicePixelRatio || 1;
    Object.assign(this, { width, height, ratio });
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
  }

  /** Shows the rectangle [low x, low y, high x, high y], in the middle and as large as it fits. */
  show([x0, y0, x1, y1]) {
    const height = this.height - FOOT;
    this.scale = Math.min(this.width / (x1 - x0), height / (y1 - y0));
    this.left = 0.5 * (this.width - this.scale * (x0 + x1));
    this.top = 0.5 * (height + this.scale * (y0 + y1));
  }

  clear() {
    const { context, canvas } = this;
    context.resetTransform();
    context.fillStyle = this.ink.floor;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.lineJoin = context.lineCap = 'round';
    this.noted = [];
    this.marks = [];
  }

  /** World [m] to pixels. */
  at([x, y]) {
    return [this.left + this.scale * x, this.top - this.scale * y];
  }

  path(points, closed = false) {
    this.context.beginPath();
    points.forEach((point, i) => this.context[i ? 'lineTo' : 'moveTo'](...this.at(point)));
    if (closed) this.context.closePath();
  }

  stroke(style, width, dash = []) {
    this.context.setLineDash(dash);
    this.context.strokeStyle = style;
    this.context.lineWidth = width;
    this.context.stroke();
    this.context.setLineDash([]);
  }

  disc(centre, radius, style, alpha = 1) {
    const { context } = this;
    context.beginPath();
    context.arc(...this.at(centre), Math.max(radius * this.scale, 1), 0, 2 * Math.PI);
    if (!style) return;
    context.globalAlpha = alpha;
    context.fillStyle = style;
    context.fill();
    context.globalAlpha = 1;
  }

  cross(point, size, style) {
    const [x, y] = this.at(point);
    this.context.beginPath();
    this.context.moveTo(x - size, y); this.context.lineTo(x + size, y);
    this.context.moveTo(x, y - size); this.context.lineTo(x, y + size);
    this.stroke(style, 1.5);
  }

  /** Notes a label beside what lies within `radius` [pixels] of a point; `labels` draws all that were noted. */
  label(text, point, radius, style, toward = 2) {
    const [x, y] = this.at(point);
    this.noted.push({ text, x, y, radius, style, toward });
    this.mark(point, radius);
  }

  /** Notes what labels keep off: what lies within `radius` [pixels] of a point. */
  mark(point, radius) {
    const [x, y] = this.at(point);
    this.marks.push({ x, y, radius });
  }

  /** Draws the labels, each at the first of eight places around its point that is free of the others' marks and words. */
  labels() {
    const { context, noted } = this, taken = [];
    context.font = '11px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.lineWidth = 3;
    context.strokeStyle = this.ink.floor;
    for (const label of noted) {
      const half = [0.5 * context.measureText(label.text).width + 1, 6];
      const places = AROUND.map((_, i) => {
        const angle = (Math.PI / 4) * (label.toward + AROUND[i]), cosine = Math.cos(angle), sine = Math.sin(angle);
        return [label.x + cosine * (label.radius + 3 + half[0]), label.y + sine * (label.radius + 3 + half[1])];
      });
      const free = ([x, y]) => x - half[0] > 0 && x + half[0] < this.width && y - half[1] > 0
        && y + half[1] < this.height
        && taken.every((box) => Math.abs(box[0] - x) > box[2] + half[0] || Math.abs(box[1] - y) > box[3] + half[1])
        && this.marks.every((other) => Math.abs(other.x - x) > other.radius + half[0]
          || Math.abs(other.y - y) > other.radius + half[1]);
      const [aside, y] = places.find(free) ?? places[0];
      const x = Math.max(half[0], Math.min(aside, this.width - half[0]));
      taken.push([x, y, ...half]);
      context.strokeText(label.text, x, y);
      context.fillStyle = label.style;
      context.fillText(label.text, x, y);
    }
    this.placed = taken; // [x, y, half width, half height] in pixels
  }

  /** A metre, for measure. */
  scaleBar() {
    const { context, ink, scale, height } = this, y = height - 9;
    context.beginPath();
    context.moveTo(12, y - 4); context.lineTo(12, y + 4);
    context.moveTo(12, y); context.lineTo(12 + scale, y);
    context.moveTo(12 + scale, y - 4); context.lineTo(12 + scale, y + 4);
    this.stroke(ink.muted, 1.5);
    context.font = '11px system-ui, sans-serif';
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    context.fillStyle = ink.muted;
    context.fillText('1 m', 18 + scale, y);
  }
}
