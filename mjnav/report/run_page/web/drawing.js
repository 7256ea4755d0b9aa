'use strict';

/* Drawing in metres on a canvas: the view, lines, discs and words. */

/** The colour behind a CSS variable, in the theme of the moment. */
function colour(name) {
  const probe = document.getElementById('probe');
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

class Drawing {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    Object.assign(this, { canvas, context: canvas.getContext('2d'), ink: {} });
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
    this.scale = Math.min(this.width / (x1 - x0), this.height / (y1 - y0));
    this.left = 0.5 * (this.width - this.scale * (x0 + x1));
    this.top = 0.5 * (this.height + this.scale * (y0 + y1));
  }

  clear() {
    const { context, canvas } = this;
    context.resetTransform();
    context.fillStyle = this.ink.floor;
    context.fillRect(0, 0, canvas.width, canvas.height);
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.lineJoin = context.lineCap = 'round';
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

  label(text, point, below, style) {
    const [x, y] = this.at(point), { context } = this;
    context.font = '11px system-ui, sans-serif';
    context.textAlign = 'center';
    context.textBaseline = 'top';
    context.lineWidth = 3;
    context.strokeStyle = this.ink.floor;
    context.strokeText(text, x, y + below);
    context.fillStyle = style;
    context.fillText(text, x, y + below);
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
