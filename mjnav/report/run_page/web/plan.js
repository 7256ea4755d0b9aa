'use strict';

/* What a page shows more of a method that plans ahead: its plan, the rollouts beside it, its violation. */

/** The violation of a plan's samples as a histogram beside its target: all at 0. */
class ViolationPanel {
  constructor(panel, run) {
    Object.assign(this, { panel, run, root: panel.querySelector('svg') });
    panel.append(panel.parentElement.querySelector('.belief')); // of the panel that this one takes the place of
  }

  resize() {
    const { root, run: { plan } } = this, width = Math.max(this.panel.clientWidth, NARROWEST);
    const bins = this.run.tables.violation.width, floor = TALL - FRAME.bottom, right = width - FRAME.right;
    root.replaceChildren();
    root.setAttribute('viewBox', `0 0 ${width} ${TALL}`);
    root.setAttribute('height', TALL);
    const slot = (right - FRAME.left) / (bins + 1); // the bar at 0 is as wide as two
    this.left = (i) => FRAME.left + (i ? i + 1 : 0) * slot;
    this.right = (i) => FRAME.left + (i + 2) * slot;
    const x = (h) => this.left(1) + (h / plan.bin) * slot;
    svg(root, 'rect', { class: 'unsafe', x: x(1), y: FRAME.top, width: right - x(1), height: floor - FRAME.top });
    svg(root, 'line', { class: 'grid', x1: FRAME.left, x2: right, y1: FRAME.top, y2: FRAME.top });
    svg(root, 'text', { class: 'tick', x: FRAME.left - 5, y: FRAME.top + 4, 'text-anchor': 'end' }, '100%');
    this.bars = svg(root, 'path', { class: 'current' });
    this.touching = svg(root, 'path', { class: 'current colliding' });
    svg(root, 'path', { class: 'desired', d: `M${this.left(0)} ${floor}V${FRAME.top}H${this.right(0)}V${floor}` });
    svg(root, 'line', { class: 'axis', x1: FRAME.left, x2: right, y1: floor, y2: floor });
    svg(root, 'line', { class: 'zero', x1: x(1), x2: x(1), y1: FRAME.top - 4, y2: floor });
    svg(root, 'text', { class: 'tick', x: x(1) + 5, y: FRAME.top - 8 }, 'contact');
    svg(root, 'text', { class: 'tick', x: this.left(0) + slot, y: floor + 13, 'text-anchor': 'middle' }, '0');
    for (const tick of [0.5, 1, 1.5, 2]) {
      svg(root, 'text', { class: 'tick', x: x(tick), y: floor + 13, 'text-anchor': 'middle' }, String(tick));
    }
    svg(root, 'text', { class: 'tick', x: 0.5 * (FRAME.left + right), y: TALL - 5, 'text-anchor': 'middle' },
      'h (graded violation, 0 clear, 1 contact)');
  }

  draw(frame) {
    const { run, panel } = this, floor = TALL - FRAME.bottom, codes = run.row('violation', frame);
    const [clear, touching] = run.row('violation_shares', frame);
    let fine = '', bad = '';
    codes.forEach((code, i) => {
      if (!code) return;
      const y = (floor - (code / 255) * (floor - FRAME.top)).toFixed(1);
      const bar = `M${this.left(i).toFixed(1)} ${floor}V${y}H${this.right(i).toFixed(1)}V${floor}Z`;
      if ((i - 1) * run.plan.bin > 1 - 1e-9) bad += bar;
      else fine += bar;
    });
    this.bars.setAttribute('d', fine);
    this.touching.setAttribute('d', bad);
    panel.querySelector('.share').style.width = `${100 * (Number.isFinite(clear) ? clear : 0)}%`;
    panel.querySelector('.share-text').textContent = quantity(100 * clear, 0, '%');
    panel.querySelector('.touching').textContent = quantity(100 * touching, 0, '%');
    this.root.setAttribute('aria-label', `${quantity(100 * clear, 0, '%')} of the samples are clear of everything, `
      + `${quantity(100 * touching, 0, '%')} touch something.`);
  }
}

/** Takes the place of the map that all kinds of runs have, of which that of a lidar's run is made, too. */
RunMap = class PlanMap extends RunMap {
  constructor(canvas, run, layers) {
    super(canvas, run, layers);
    const panel = canvas.closest('.run').querySelector('.violation');
    panel.hidden = !run.plan?.violation;
    if (!panel.hidden) this.violation = new ViolationPanel(panel, run);
  }

  recolour() {
    super.recolour();
    this.ink.bad = colour('bad');
  }

  resize() {
    this.violation?.resize();
    super.resize();
  }

  draw(frame) {
    super.draw(frame);
    this.violation?.draw(this.run.tickOf(frame));
  }

  /** Below people and the robot: the fan, and the plan above it. */
  people(frame) {
    const tick = this.run.tickOf(frame), path = this.run.plan ? this.run.row('plan', tick) : [];
    if (Number.isFinite(path[0])) {
      if (this.layers.fan) this.fan(tick, path);
      if (this.layers.plan) this.plan(tick, path);
    }
    super.people(frame);
  }

  /** The rollouts by the order of their cost, the cheapest last and so above. */
  fan(tick, [x0, y0]) {
    const { run, context } = this, moves = run.row('fan', tick), start = run.row('estimate', tick);
    const [rollouts, points] = run.plan.fan, size = 2 * points;
    const known = Array.from({ length: rollouts }, (_, i) => i).filter((i) => Number.isFinite(moves[i * size]));
    context.globalAlpha = 0.8;
    for (const i of known.toReversed()) {
      const way = Number.isFinite(start[0]) ? [start] : [];
      let [x, y] = [x0, y0];
      for (let j = i * size; j < (i + 1) * size && Number.isFinite(moves[j]); j += 2) {
        way.push([x += moves[j], y += moves[j + 1]]);
      }
      this.path(way);
      this.stroke(this.levels[Math.floor((i * run.levels) / known.length)], this.layers.follow ? 1.5 : 1);
    }
    context.globalAlpha = 1;
  }

  /** The plan, a dot a step, and where the robot would stand at its end; red and dashed where it is not feasible. */
  plan(tick, path) {
    const { run, ink, context } = this, { radius } = run.scene, points = [];
    for (let i = 0; i < path.length && Number.isFinite(path[i]); i += 2) points.push([path[i], path[i + 1]]);
    const feasible = run.at('plan_feasible', tick) !== 0, style = feasible ? ink.ink : ink.bad;
    const start = run.row('estimate', tick), end = points[points.length - 1];
    this.path(Number.isFinite(start[0]) ? [start, ...points] : points);
    this.stroke(ink.floor, 5);
    this.stroke(style, 2.4, feasible ? [] : [5, 4]);
    context.fillStyle = style;
    for (const point of points) {
      context.beginPath();
      context.arc(...this.at(point), 2.6, 0, 2 * Math.PI);
      context.fill();
    }
    this.disc(end, radius, style, 0.12);
    this.stroke(style, 1.4, feasible ? [] : [5, 4]);
    if (feasible) this.mark(end, radius * this.scale);
    else this.label('infeasible', end, radius * this.scale, style);
  }
};
