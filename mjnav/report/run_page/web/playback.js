'use strict';

/* Time: what plays it, moves it and shows it. */

const SAME = 1e-6; // [s]

class Playback {
  /**
   * @param {number[]} times [s] of all frames of all runs, rising
   * @param {number[]} moments [s] worth a look, rising
   * @param {(time: number) => void} show
   * @param {(time: number, picked: boolean) => void} settled where the user stopped, or what the user picked
   */
  constructor(times, moments, show, settled) {
    Object.assign(this, { times, moments, show, settled, index: 0, playing: false, speed: 1 });
    this.slider = document.getElementById('time');
    this.button = document.getElementById('play');
    this.clock = document.getElementById('clock');
    this.spoken = document.getElementById('spoken');
    this.slider.max = String(times.length - 1);
    document.getElementById('end').textContent = quantity(times[times.length - 1], 1, 's');
    this.slider.addEventListener('input', () => this.go(Number(this.slider.value)));
    this.button.addEventListener('click', () => this.toggle());
    document.getElementById('speed').addEventListener('change', ({ target }) => {
      this.speed = Number(target.value);
    });
    document.getElementById('first').addEventListener('click', () => this.go(0));
    document.getElementById('back').addEventListener('click', () => this.go(this.index - 1));
    document.getElementById('forward').addEventListener('click', () => this.go(this.index + 1));
    document.addEventListener('keydown', (event) => this.key(event));
  }

  get time() {
    return this.times[this.index];
  }

  /** The last frame at or before `time`. */
  indexAt(time) {
    let index = this.times.findIndex((other) => other > time + SAME);
    if (index < 0) index = this.times.length;
    return Math.max(0, index - 1);
  }

  /** Shows a frame; `quiet` while it plays, so that a screen reader is not flooded. */
  go(index, quiet = false) {
    this.index = Math.min(Math.max(index, 0), this.times.length - 1);
    if (!quiet) this.moment = this.time;
    const text = quantity(this.time, 2, 's');
    this.slider.value = String(this.index);
    this.slider.setAttribute('aria-valuetext', text);
    this.clock.textContent = text;
    this.show(this.time);
    if (quiet) return;
    this.say(text);
    this.settle(false);
  }

  /** The frame nearest to `time`. */
  nearest(time) {
    const index = this.indexAt(time), next = this.times[index + 1] ?? Infinity;
    return next - time < time - this.times[index] ? index + 1 : index;
  }

  /** Shows the frame nearest to `time`. */
  seek(time, quiet = false) {
    this.go(this.nearest(time), quiet);
    this.moment = this.time;
  }

  /** Shows a moment that was picked from a list. */
  pick(time) {
    this.seek(time);
    this.settle(true);
  }

  /** Tells where the user is: at once what was picked, else once the user rests. */
  settle(picked) {
    clearTimeout(this.settling);
    if (picked) this.settled(this.time, true);
    else this.settling = setTimeout(() => { if (!this.playing) this.settled(this.time, false); }, 300);
  }

  /** Tells a screen reader once the user rests. */
  say(text) {
    clearTimeout(this.saying);
    this.saying = setTimeout(() => { this.spoken.textContent = text; }, 300);
  }

  toggle() {
    if (this.playing) return this.pause();
    if (this.index === this.times.length - 1) this.go(0, true);
    this.playing = true;
    this.moment = this.time;
    this.last = null;
    this.label();
    return requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.playing = false;
    this.label();
    this.say(quantity(this.time, 2, 's'));
    this.settle(true);
  }

  label() {
    this.button.classList.toggle('playing', this.playing);
    this.button.setAttribute('aria-label', this.playing ? 'Pause' : 'Play');
  }

  tick(now) {
    if (!this.playing) return;
    if (this.last !== null) {
      this.moment += 0.001 * (now - this.last) * this.speed;
      const index = this.indexAt(this.moment);
      if (index !== this.index) this.go(index, true);
    }
    this.last = now;
    if (this.index === this.times.length - 1) this.pause();
    else requestAnimationFrame((next) => this.tick(next));
  }

  /** The next of the moments worth a look, or the one before. */
  jump(direction) {
    const { moments, time } = this;
    const next = direction > 0
      ? moments.find((moment) => this.indexAt(moment) > this.index)
      : moments.findLast((moment) => this.indexAt(moment) < this.index);
    if (next !== undefined && this.nearest(next) !== this.index) this.pick(next);
    else this.seek(time);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches('select')) return;
    const pressed = event.target.matches('button, summary, input[type=checkbox]'); // by the space bar
    const actions = {
      ' ': () => this.toggle(),
      ArrowLeft: () => (event.shiftKey ? this.seek(this.time - 1) : this.go(this.index - 1)),
      ArrowRight: () => (event.shiftKey ? this.seek(this.time + 1) : this.go(this.index + 1)),
      Home: () => this.go(0),
      End: () => this.go(this.times.length - 1),
      n: () => this.jump(1),
      p: () => this.jump(-1),
    };
    const number = /^[1-9]$/.test(event.key) ? document.querySelector(`[data-moment="${event.key}"]`) : null;
    const action = number ? () => this.pick(Number(number.dataset.seek)) : actions[event.key];
    if (!action || (event.key === ' ' && pressed)) return;
    event.preventDefault();
    action();
  }
}
