'use strict';

/* F and F^des of the closest obstacle at a frame, as histograms over f, and the share of samples that is safe. */

const SVG = 'http://www.w3.org/2000/svg';

/** A new SVG element with attributes, inside `parent`. */
function svg(parent, name, attributes = {}, text = null) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  parent.append(element);
  return element;
}

const FRAME = { left: 34, right: 8, top: 20, bottom: 34 };
const TALL = 190; // [pixels] the drawing
const NARROWEST = 120; // [pixels]
const SHARE_TOPS = [0.1, 0.25, 0.5, 1]; // that the axis may end at

class Distribution {
  /** @param {HTMLElement} parent where the drawing, its heading and the bar go */
  constructor(parent, run) {
    Object.assign(this, { parent, run, cone: run.cone });
    this.heading = parent.querySelector('.cone-obstacle');
    this.bar = parent.querySelector('.safe-share');
    this.root = parent.querySelector('svg');
    parent.hidden = !run.cone;
    this.resize();
  }

  resize() {
    if (!this.cone) return;
    const width = Math.max(this.parent.clientWidth, NARROWEST); // 0 in a frame that is not laid out yet
    const { low, width: step, bins } = this.cone, { root } = this;
    root.replaceChildren();
    root.setAttribute('viewBox', `0 0 ${width} ${TALL}`);
    root.setAttribute('height', TALL);
    this.x = (f) => FRAME.left + ((f - low) / (step * bins)) * (width - FRAME.left - FRAME.right);
    const floor = TALL - FRAME.bottom, high = low + step * bins;
    svg(root, 'rect', { class: 'unsafe', x: this.x(0), y: FRAME.top, width: this.x(high) - this.x(0),
      height: floor - FRAME.top });
    this.topLine = svg(root, 'line', { class: 'grid', x1: FRAME.left, x2: width - FRAME.right });
    this.topLabel = svg(root, 'text', { class: 'tick', x: FRAME.left - 5, 'text-anchor': 'end' });
    this.bars = svg(root, 'path', { class: 'current' });
    this.colliding = svg(root, 'path', { class: 'current colliding' });
    this.outline = svg(root, 'path', { class: 'desired' });
    svg(root, 'line', { class: 'axis', x1: FRAME.left, x2: width - FRAME.right, y1: floor, y2: floor });
    svg(root, 'line', { class: 'zero', x1: this.x(0), x2: this.x(0), y1: FRAME.top - 4, y2: floor });
    const right = Math.min(this.x(0) + 5, width - 50); // where "colliding" begins, so that it is not cut off
    svg(root, 'text', { class: 'tick', x: right - 10, y: FRAME.top - 8, 'text-anchor': 'end' }, 'safe');
    svg(root, 'text', { class: 'tick', x: right, y: FRAME.top - 8 }, 'colliding');
    for (const tick of niceTicks(low, high, 6)) {
      svg(root, 'text', { class: 'tick', x: this.x(tick), y: floor + 13, 'text-anchor': 'middle' }, tickText(tick));
    }
    const label = `${this.run.normalised ? 'f / R²' : 'f [m²]'} (collision cone, safe ≤ 0)`;
    const middle = 0.5 * (FRAME.left + width - FRAME.right);
    svg(root, 'text', { class: 'tick', x: middle, y: TALL - 5, 'text-anchor': 'middle' }, label);
  }

  draw(frame) {
    if (!this.cone) return;
    const { bins, low, width: step } = this.cone, floor = TALL - FRAME.bottom;
    const obstacle = this.run.coneObstacle(frame), row = this.run.row('cone', frame);
    const current = row.subarray(0, bins), desired = row.subarray(bins, 2 * bins);
    const most = Math.max(...row) / 255, top = SHARE_TOPS.find((share) => share >= most - 1e-9) ?? 1;
    const height = (code) => (code / 255 / top) * (floor - FRAME.top);
    const edge = (i) => this.x(low + i * step).toFixed(1);
    let safe = '', colliding = '', outline = `M${edge(0)} ${floor}`;
    for (let i = 0; i < bins; i++) {
      const y = (floor - height(current[i])).toFixed(1);
      const bar = current[i] ? `M${edge(i)} ${floor}V${y}H${edge(i + 1)}V${floor}Z` : '';
      if (low + (i + 0.5) * step <= 0) safe += bar;
      else colliding += bar;
      outline += `V${(floor - height(desired[i])).toFixed(1)}H${edge(i + 1)}`;
    }
    this.bars.setAttribute('d', safe);
    this.colliding.setAttribute('d', colliding);
    this.outline.setAttribute('d', desired.some(Boolean) ? `${outline}V${floor}` : '');
    this.topLine.setAttribute('y1', FRAME.top);
    this.topLine.setAttribute('y2', FRAME.top);
    this.topLabel.setAttribute('y', FRAME.top + 4);
    this.topLabel.textContent = `${100 * top}%`;
    const share = this.run.at('safe_share', frame);
    this.heading.textContent = obstacle ?? 'none in range';
    this.bar.querySelector('.share').style.width = `${100 * (Number.isFinite(share) ? share : 0)}%`;
    this.bar.querySelector('.share-text').textContent = quantity(100 * share, 0, '%');
    this.parent.classList.toggle('empty', obstacle === null);
    this.root.setAttribute('aria-label', obstacle === null ? 'No obstacle in range.'
      : `Closest obstacle ${obstacle}: ${quantity(100 * share, 0, '%')} of the samples are safe.`);
  }
}
