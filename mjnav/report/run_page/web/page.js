'use strict';

/* Puts the page together: runs, maps, plots and time. */

/** A control of the page that shows or hides a layer of all maps. */
function layerSwitches(redraw) {
  const layers = {};
  for (const box of document.querySelectorAll('input[data-layer]')) {
    layers[box.dataset.layer] = box.checked;
    box.addEventListener('change', () => {
      layers[box.dataset.layer] = box.checked;
      redraw();
    });
  }
  return layers;
}

/** What one run is doing, as figures beside its map. */
function readouts(block, run) {
  const places = {};
  for (const place of block.querySelectorAll('[data-now]')) places[place.dataset.now] = place;
  return (frame) => {
    const [v, omega] = run.row('twist', frame), [toV, toOmega] = run.row('command', frame);
    const status = run.status(frame), ended = frame === run.last;
    places.speed.textContent = quantity(v, 2, 'm/s');
    places['speed-command'].textContent = quantity(toV, 2);
    places.turn.textContent = quantity(omega, 2, 'rad/s');
    places['turn-command'].textContent = quantity(toOmega, 2);
    places.clearance.textContent = quantity(run.at('clearance', frame), 2, 'm');
    places.nearest.textContent = run.bodies[run.at('nearest', frame)] ?? '';
    places.cost.textContent = compact(run.at('cost', frame, 3));
    places.status.textContent = status ? status.replace('_', ' ') : ended ? 'the run ended' : '\u2013';
    places.belief.hidden = run.tickOf(frame) === frame;
    places.status.classList.toggle('warned', status !== null && status.startsWith('infeasible'));
  };
}

/** The time of every frame of every run, once and in order. */
function allTimes(runs) {
  const every = runs.flatMap((run) => [...run.time]).sort((a, b) => a - b);
  return every.filter((time, i) => i === 0 || time - every[i - 1] > SAME);
}

function themeSwitch(changed) {
  const root = document.documentElement, dark = matchMedia('(prefers-color-scheme: dark)');
  document.getElementById('theme').addEventListener('click', () => {
    const now = root.dataset.theme ?? (dark.matches ? 'dark' : 'light');
    root.dataset.theme = now === 'dark' ? 'light' : 'dark';
    changed();
  });
  dark.addEventListener('change', changed);
  let before;
  addEventListener('beforeprint', () => { before = root.dataset.theme; root.dataset.theme = 'light'; changed(); });
  addEventListener('afterprint', () => {
    if (before === undefined) delete root.dataset.theme;
    else root.dataset.theme = before;
    changed();
  });
}

async function start() {
  const packed = JSON.parse(document.getElementById('runs').textContent);
  const runs = await Promise.all(packed.map((run, index) => Run.load(run, index)));
  const blocks = [...document.querySelectorAll('.run')];
  const times = allTimes(runs), duration = times[times.length - 1] - times[0] || 1;
  let playback = null;
  const redraw = () => playback?.show(playback.time);
  const layers = layerSwitches(redraw);
  const views = runs.map((run, i) => ({
    run,
    map: new (run.lidar ? LidarMap : RunMap)(blocks[i].querySelector('canvas'), run, layers),
    cone: new Distribution(blocks[i].querySelector('.cone'), run),
    read: readouts(blocks[i], run),
  }));
  const seek = (time) => playback.seek(times[0] + time);
  for (const { run, map } of views) {
    const point = ({ type, clientX, clientY }) => {
      const found = type === 'pointerleave' ? null : map.personAt(clientX, clientY, run.frameAt(playback.time));
      if (found === map.pointed) return;
      map.pointed = found;
      redraw();
    };
    for (const type of ['pointermove', 'pointerdown', 'pointerleave']) map.canvas.addEventListener(type, point);
  }
  const plots = plotSpecs(runs).filter((spec) => spec.series.some((series) => series.values.some(Number.isFinite)))
    .map((spec) => new TimePlot(document.getElementById('plots'), spec, duration, seek));
  const show = (time) => {
    for (const { run, map, cone, read } of views) {
      const frame = run.frameAt(time);
      map.draw(frame);
      cone.draw(run.tickOf(frame));
      read(frame);
    }
    plots.forEach((plot) => plot.cursor(time - times[0]));
    showMoment(moments, (moment) => playback && playback.nearest(moment.time) === playback.index);
  };
  const moments = [...document.querySelectorAll('[data-moment]')].map((button) => ({
    button, time: Number(button.dataset.seek), number: button.dataset.moment,
    text: ['.letter', '.what'].map((part) => button.querySelector(part)?.textContent).filter(Boolean).join(', '),
  }));
  const first = (kind) => document.querySelector(`[data-moment][data-kind=${kind}]`);
  const allReached = document.querySelector('[data-outcome]:not(.good)') === null;
  const worst = first('contact') ?? (allReached ? first('clearance') : null) ?? moments[0]?.button;
  const opening = worst ? Number(worst.dataset.seek) : times[0];
  playback = new Playback(times, moments.map(({ time }) => time).sort((a, b) => a - b), show, setAddress);
  const strip = () => timeStrip(runs, moments, times[0], duration);
  strip();
  for (const button of document.querySelectorAll('button[data-seek]')) {
    button.addEventListener('click', () => playback.pick(Number(button.dataset.seek)));
  }
  addEventListener('popstate', () => playback.seek(addressed() ?? opening, true));
  themeSwitch(() => { views.forEach(({ map }) => map.recolour()); redraw(); });
  let width = innerWidth;
  addEventListener('resize', () => {
    if (innerWidth === width) return; // a phone's address bar only changes the height
    width = innerWidth;
    views.forEach(({ map, cone }) => { cone.resize(); map.resize(); });
    plots.forEach((plot) => plot.resize());
    strip();
    redraw();
  });
  views.forEach(({ map }) => map.resize()); // now that all have their place
  plots.forEach((plot) => plot.resize());
  playback.seek(addressed() ?? opening, true);
  document.documentElement.dataset.ready = 'yes';
}

start().catch((error) => {
  const notice = document.getElementById('failed');
  notice.textContent = `The playback cannot start in this browser: ${error.message}. The figures below are complete.`;
  notice.hidden = false;
});
