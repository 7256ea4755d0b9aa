'use strict';

/* The map: the room from above, and all that a frame has in it. */

const PADDING = 0.45; // [m] around the room
const STRAY = 2.5; // [m] that people may walk out of the room and still widen the map
const CLOSE_UP = 3.2; // [m] seen to each side of the robot when it is followed

/** Where a robot on (v, omega) is after `time`: the exact arc. */
function arcPoint(pose, v, omega, time) {
  const half = 0.5 * omega * time;
  const chord = v * time * (Math.abs(half) > 1e-9 ? Math.sin(half) / half : 1);
  return [pose[0] + chord * Math.cos(pose[2] + half), pose[1] + chord * Math.sin(pose[2] + half)];
}

/** The rectangle [low x, low y, high x, high y] that a run's map covers. */
function bounds(run) {
  const box = [Infinity, Infinity, -Infinity, -Infinity];
  const add = (x, y, margin = 0) => {
    if (!Number.isFinite(x + y)) return;
    box[0] = Math.min(box[0], x - margin); box[1] = Math.min(box[1], y - margin);
    box[2] = Math.max(box[2], x + margin); box[3] = Math.max(box[3], y + margin);
  };
  const scene = run.scene;
  scene.walls.forEach((wall) => [wall.from, wall.to].forEach(([x, y]) => add(x, y, wall.thickness / 2)));
  scene.tables.forEach((table) => table.corners.forEach(([x, y]) => add(x, y)));
  scene.pillars.forEach((pillar) => add(...pillar.position, pillar.radius));
  [scene.start, ...scene.route].forEach(([x, y]) => add(x, y, scene.radius));
  scene.lanes.forEach(([a, b, c]) => [scene.start, ...scene.route].forEach(([x, y]) => {
    const share = (a * x + b * y + c) / (a * a + b * b);
    add(x - a * share, y - b * share, 0.2);
  }));
  for (let frame = 0; frame <= run.last; frame++) add(run.at('pose', frame, 0), run.at('pose', frame, 1), scene.radius);
  const room = box.slice();
  const inside = (x, y) => x > room[0] - STRAY && y > room[1] - STRAY && x < room[2] + STRAY && y < room[3] + STRAY;
  if (!scene.walls.length && run.tables.people) {
    const people = run.tables.people.values;
    for (let i = 0; i < people.length; i += 2) if (inside(people[i], people[i + 1])) add(people[i], people[i + 1], 0.3);
  }
  return [box[0] - PADDING, box[1] - PADDING, box[2] + PADDING, box[3] + PADDING];
}

class RunMap extends Drawing {
  /** @param {Object} layers which of candidates, particles, estimates, follow are on */
  constructor(canvas, run, layers) {
    super(canvas);
    Object.assign(this, { run, layers, box: bounds(run) });
    this.recolour();
  }

  /** Reads the theme's colours. */
  recolour() {
    this.ink = Object.fromEntries(['floor', 'wall', 'table', 'top', 'pillar', 'lane', 'goal', 'robot', 'people', 'ink',
      'muted', 'surface'].map((name) => [name, colour(name)]));
    this.levels = Array.from({ length: this.run.levels }, (_, level) => colour(`level-${level}`));
  }

  /** Fits the canvas to the width that it has. */
  resize() {
    const [x0, y0, x1, y1] = this.box;
    const width = this.canvas.parentElement.clientWidth;
    const tallest = Math.max(260, 0.62 * window.innerHeight);
    const height = Math.min(Math.max((width * (y1 - y0)) / (x1 - x0) + FOOT, 200), tallest);
    this.fit(width, height);
    const room = this.canvas.parentElement.clientHeight; // what stands beside the map may be higher
    if (room > height) this.fit(width, room);
  }

  draw(frame) {
    const { layers } = this;
    this.place(frame);
    this.clear();
    this.room();
    if (layers.ways) { this.plannedWays(frame); this.ownWay(frame); }
    this.trail(frame);
    if (layers.candidates) this.candidates(frame);
    if (layers.predictions) this.predictedWays(frame);
    this.people(frame);
    this.robot(frame);
    this.labels();
    this.scaleBar();
    this.canvas.setAttribute('aria-label', this.description(frame));
  }

  /** Sets the view: the whole room, or what is around the robot. */
  place(frame) {
    if (!this.layers.follow) return this.show(this.box);
    const [x, y] = this.run.row('pose', frame);
    return this.show([x - CLOSE_UP, y - 0.5 * CLOSE_UP, x + CLOSE_UP, y + 0.5 * CLOSE_UP]);
  }

  room() {
    const { context, ink, run: { scene } } = this;
    for (const [a, b, c] of scene.lanes) {
      const size = Math.hypot(a, b), foot = [(-a * c) / size ** 2, (-b * c) / size ** 2];
      this.path([-200, 200].map((far) => [foot[0] - (b / size) * far, foot[1] + (a / size) * far]));
      this.stroke(ink.lane, 2.5, [14, 9]);
    }
    scene.route.forEach((point, i) => {
      this.disc(point, scene.goal_tolerance, ink.goal, 0.18);
      this.stroke(ink.goal, 1.5);
      this.cross(point, 5, ink.goal);
      const name = i < scene.route.length - 1 ? String(i + 1) : 'goal';
      this.label(name, point, scene.goal_tolerance * this.scale, ink.goal);
    });
    for (const table of scene.tables) {
      this.path(table.corners, true);
      context.fillStyle = ink.top;
      context.fill();
      this.stroke(ink.table, 1);
      table.legs.forEach((leg) => this.disc(leg, table.leg_radius, ink.table));
    }
    scene.pillars.forEach((pillar) => this.disc(pillar.position, pillar.radius, ink.pillar));
    context.lineCap = 'butt';
    for (const wall of scene.walls) {
      const length = Math.hypot(wall.to[0] - wall.from[0], wall.to[1] - wall.from[1]);
      const past = wall.thickness / 2 / length; // the drawn line covers the corner where two walls meet
      const toward = (p, q) => [p[0] + (p[0] - q[0]) * past, p[1] + (p[1] - q[1]) * past];
      this.path([toward(wall.from, wall.to), toward(wall.to, wall.from)]);
      this.stroke(ink.wall, Math.max(wall.thickness * this.scale, 2));
    }
    context.lineCap = 'round';
    this.disc(scene.start, scene.radius);
    this.stroke(ink.muted, 1, [3, 4]);
    this.label('start', scene.start, scene.radius * this.scale, ink.muted);
  }

  /** The ways to their waypoints of those who are there. */
  plannedWays(frame) {
    const people = this.run.row('people', frame);
    this.context.globalAlpha = 0.5;
    for (const { person, points } of this.run.scene.people_legs) {
      if (!Number.isFinite(people[2 * person])) continue;
      this.path(points);
      this.stroke(this.ink.people, 1, [2, 5]);
    }
    this.context.globalAlpha = 1;
  }

  /** The way that the robot planned last, and what it had drawn of the floor by then. */
  ownWay(frame) {
    const { run, ink, context } = this, tick = run.tickOf(frame);
    const until = run.scene.own_ways.filter((one) => one.frame <= tick), way = until.at(-1);
    if (!way) return;
    context.globalAlpha = 0.45;
    for (const [x, y, radius] of until.findLast((one) => one.drawn).drawn) this.disc([x, y], radius, ink.wall);
    context.globalAlpha = 1;
    this.path(way.line);
    this.stroke(ink.goal, 1.6, [6, 4]);
  }

  /** How the people closest to the robot are predicted to go on, a line a sample. */
  predictedWays(frame) {
    const { run } = this, tick = run.tickOf(frame);
    const owners = run.row('way_of', tick), ways = run.row('ways', tick), tracks = run.row('tracks', tick);
    const [, people, samples, points] = run.fields.ways?.shape ?? [];
    this.context.globalAlpha = 0.5;
    for (let i = 0; i < people * samples; i++) {
      const owner = owners[Math.floor(i / samples)], way = [];
      if (owner >= run.tracks.length || !Number.isFinite(ways[2 * i * points])) continue;
      let [x, y] = [tracks[5 * owner], tracks[5 * owner + 1]];
      for (let j = i * points; j < (i + 1) * points; j++) way.push([x += ways[2 * j], y += ways[2 * j + 1]]);
      this.path(way);
      this.stroke(this.ink.people, 1);
    }
    this.context.globalAlpha = 1;
  }

  trail(frame) {
    const pose = this.run.tables.pose;
    const points = (from, to) => Array.from({ length: to - from + 1 }, (_, i) => pose.row(from + i));
    this.path(points(frame, this.run.last));
    this.context.globalAlpha = 0.35;
    this.stroke(this.ink.robot, 1.2, [2, 5]);
    this.context.globalAlpha = 1;
    this.path(points(0, frame));
    this.stroke(this.ink.robot, 2.2);
  }

  candidates(frame) {
    const pose = this.run.row('estimate', frame);
    if (!Number.isFinite(pose[0])) return;
    const arc = (v, omega) => this.path([0, 0.25, 0.5, 0.75, 1].map((share) =>
      arcPoint(pose, v, omega, share * this.run.preview)));
    this.context.globalAlpha = 0.75;
    for (const candidate of this.run.candidateArcs(frame)) {
      arc(candidate.v, candidate.omega);
      this.stroke(this.levels[candidate.level], this.layers.follow ? 1.4 : 0.9);
    }
    this.context.globalAlpha = 1;
    const nominal = this.run.row('nominal', frame), chosen = this.run.row('decision', frame);
    if (Number.isFinite(chosen[0])) {
      arc(...chosen);
      this.stroke(this.ink.floor, 6);
      this.stroke(this.ink.ink, 3.2);
    }
    if (Number.isFinite(nominal[0])) {
      arc(...nominal);
      this.stroke(this.ink.muted, 1.6, [4, 4]);
    }
  }

  ellipse(row, x, y, first, style, dash = [4, 3]) {
    if (!Number.isFinite(row[first])) return;
    const { context, scale } = this;
    context.beginPath();
    context.ellipse(...this.at([x, y]), row[first] * scale, row[first + 1] * scale, -row[first + 2], 0, 2 * Math.PI);
    this.stroke(style, 1.4, dash);
  }

  particles(offsets, x, y, style) {
    const { context } = this, size = this.layers.follow ? 2.4 : 1.8;
    context.fillStyle = style;
    context.globalAlpha = 0.6;
    for (let i = 0; i < offsets.length; i += 2) {
      if (!Number.isFinite(offsets[i])) continue;
      const [px, py] = this.at([x + offsets[i], y + offsets[i + 1]]);
      context.fillRect(px - size / 2, py - size / 2, size, size);
    }
    context.globalAlpha = 1;
  }

  people(frame) {
    const { run, ink } = this;
    const people = run.row('people', frame), before = run.row('people', Math.max(0, frame - 1));
    const pause = run.time[frame] - run.time[Math.max(0, frame - 1)];
    run.people.forEach((name, i) => {
      const [x, y] = [people[2 * i], people[2 * i + 1]];
      if (!Number.isFinite(x)) return;
      const radius = run.scene.people_radius[i] ?? 0.3;
      this.disc([x, y], radius, ink.people, 0.28);
      this.stroke(ink.people, 1.6);
      if (pause > 0) {
        const ahead = [x + (x - before[2 * i]) / pause, y + (y - before[2 * i + 1]) / pause];
        if (Math.hypot(ahead[0] - x, ahead[1] - y) > 0.02) {
          this.path([[x, y], ahead]);
          this.stroke(ink.people, 1.4);
        }
      }
      const number = name.replace('person', ''), words = i === this.pointed && run.scene.people_words[i];
      this.label(words ? `${number}: ${words}` : number, [x, y], radius * this.scale, words ? ink.ink : ink.muted, -1);
    });
    this.tracks(frame);
  }

  tracks(frame) {
    const { run, ink, layers } = this, tick = run.tickOf(frame);
    const tracks = run.row('tracks', tick), particles = run.row('track_particles', tick);
    run.tracks.forEach((name, i) => {
      const track = tracks.subarray(5 * i, 5 * i + 5), number = particles.length / run.tracks.length;
      if (!Number.isFinite(track[0])) return;
      this.mark(track, track[2] * this.scale);
      if (layers.particles) {
        this.particles(particles.subarray(i * number, (i + 1) * number), track[0], track[1], ink.people);
      }
      if (layers.estimates) {
        this.ellipse(track, track[0], track[1], 2, ink.people);
        this.cross(track, 3, ink.people);
      }
    });
  }

  robot(frame) {
    const { run, ink, layers } = this;
    const pose = run.row('pose', frame), radius = run.scene.radius;
    const tick = run.tickOf(frame), estimate = run.row('estimate', tick);
    for (const [ahead, own] of run.scene.discs) {
      this.disc([pose[0] + ahead * Math.cos(pose[2]), pose[1] + ahead * Math.sin(pose[2])], own, ink.robot, 0.92);
    }
    this.mark(pose, radius * this.scale);
    const nose = [-2.5, 0, 2.5].map((turn) => [
      pose[0] + 0.78 * radius * Math.cos(pose[2] + turn), pose[1] + 0.78 * radius * Math.sin(pose[2] + turn)]);
    const notch = [pose[0] - 0.3 * radius * Math.cos(pose[2]), pose[1] - 0.3 * radius * Math.sin(pose[2])];
    this.path([...nose, notch], true);
    this.context.fillStyle = ink.surface;
    this.context.fill();
    if (!Number.isFinite(estimate[0])) return;
    if (layers.particles) this.particles(run.row('robot_particles', tick), estimate[0], estimate[1], ink.ink);
    if (layers.estimates) this.ellipse(run.row('ellipse', tick), estimate[0], estimate[1], 0, ink.ink);
  }

  /** The person at a place of the screen, or null. */
  personAt(clientX, clientY, frame) {
    const box = this.canvas.getBoundingClientRect(), people = this.run.row('people', frame);
    const found = this.run.people.findIndex((_, i) => {
      const [x, y] = this.at([people[2 * i], people[2 * i + 1]]);
      const reach = Math.max((this.run.scene.people_radius[i] ?? 0.3) * this.scale, 12);
      return Math.hypot(box.left + x - clientX, box.top + y - clientY) < reach;
    });
    return found < 0 ? null : found;
  }

  /** The frame in words. */
  description(frame) {
    const { run } = this, [x, y, heading] = run.row('pose', frame);
    const degrees = (((heading * 180) / Math.PI + 540) % 360) - 180;
    const near = run.at('clearance', frame);
    const parts = [
      `Map at ${quantity(run.time[frame], 1, 's')}: robot at x ${quantity(x, 2, 'm')}, y ${quantity(y, 2, 'm')}`,
      `heading ${quantity(degrees, 0, 'degrees')}`,
    ];
    if (Number.isFinite(near)) parts.push(`${quantity(near, 2, 'm')} from the nearest surface`);
    if (run.status(frame)) parts.push(`decision ${run.status(frame).replace('_', ' ')}`);
    const there = run.people.filter((_, i) => Number.isFinite(run.at('people', frame, 2 * i))).length;
    if (run.people.length) parts.push(`${there} of ${run.people.length} people there`);
    return `${parts.join(', ')}.`;
  }
}
