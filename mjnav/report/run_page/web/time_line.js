'use strict';

/* Moments: where they stand on the time line, which one is shown, and the one that the page's address names. */

const DIGIT = 7; // [pixels] that a digit of a number takes, and between two numbers

/** Centres, as near as can be to the wished ones (rising), of marks that are `sizes` wide and lie within `width`. */
function spread(wished, sizes, width) {
  const centres = [];
  wished.forEach((place, i) => {
    const free = i ? centres[i - 1] + 0.5 * (sizes[i - 1] + sizes[i]) : 0.5 * sizes[0];
    centres.push(Math.max(place, free));
  });
  let end = width;
  for (let i = centres.length - 1; i >= 0; i--) {
    centres[i] = Math.min(centres[i], end - 0.5 * sizes[i]);
    end = centres[i] - 0.5 * sizes[i];
  }
  return centres;
}

/** Fills the time line: ticks at which nothing was allowed, and the numbers of the worst moments. */
function timeStrip(runs, moments, start, duration) {
  const strip = document.getElementById('strip'), width = strip.clientWidth;
  const add = (name, style, time) => {
    const mark = strip.appendChild(document.createElement(name));
    mark.className = style;
    mark.style.left = `${(100 * (time - start)) / duration}%`;
    return mark;
  };
  strip.replaceChildren();
  for (const run of runs) {
    run.tables.status.column(0).forEach((code, frame) => {
      if (!(run.statuses[code] ?? '').startsWith('infeasible')) return;
      add('i', 'infeasible', run.time[frame]).style.width = `${(100 * run.period * run.stride) / duration}%`;
    });
  }
  const size = ({ number }) => DIGIT * (number.length + 1);
  let room = width;
  const fitting = moments.filter((moment) => (room -= size(moment)) >= 0); // the worst ones of each run come first
  fitting.sort((a, b) => a.time - b.time);
  const wished = fitting.map(({ time }) => ((time - start) / duration) * width);
  spread(wished, fitting.map(size), width).forEach((centre, i) => {
    add('i', 'moment', fitting[i].time);
    const mark = add('span', '', 0);
    mark.textContent = fitting[i].number;
    mark.style.left = `${centre}px`;
  });
}

/** Marks the moments that are shown, and says in words what the first of them is. */
function showMoment(moments, isShown) {
  let first = null;
  for (const moment of moments) {
    const here = isShown(moment);
    if (here) moment.button.setAttribute('aria-current', 'true');
    else moment.button.removeAttribute('aria-current');
    if (here) first ??= moment;
  }
  document.getElementById('seen').textContent = first ? `Worst moment ${first.number}: ${first.text}` : '';
}

/** The time [s] that the page's address ends in, as #t=15.5; null where it ends in none. */
function addressed() {
  const found = /^#t=([+-]?\d+(?:\.\d*)?)s?$/.exec(location.hash);
  return found ? Number(found[1]) : null;
}

/** Puts a time into the page's address; what was picked becomes a step of the browser's history. */
function setAddress(time, picked) {
  const hash = `#t=${Number(time.toFixed(3))}`;
  if (location.protocol === 'about:' || location.hash === hash) return; // in a notebook a page has no address
  try {
    if (picked) history.pushState(null, '', hash);
    else history.replaceState(null, '', hash);
  } catch { /* a frame that may not change its address is a page like any other */ }
}
