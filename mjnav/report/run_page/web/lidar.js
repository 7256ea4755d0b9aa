'use strict';

/* What a map shows more where the robot goes by its lidar: scans, detections, tracks and their lives, its own map. */

const LOST = 0.2; // [m] error at which the believed robot is drawn, too
const FEW_TRACKS = 12; // whose lives can be read

/** Where the robot believed to be at `time` [s]: straight between two frames. */
function believedPose(run, time) {
  const frame = run.frameAt(time), next = Math.min(frame + 1, run.last);
  const pose = run.row('estimate', frame), after = run.row('estimate', next);
  if (next === frame || !Number.isFinite(after[0])) return pose;
  const share = Math.min(1, Math.max(0, (time - run.time[frame]) / (run.time[next] - run.time[frame])));
  return pose.map((value, i) => value + share * (after[i] - value));
}

/** The frame at which the latest scan came. */
function scanFrame(run, frame) {
  const number = run.at('scan_of', frame);
  while (frame > 0 && run.at('scan_of', frame - 1) === number) frame -= 1;
  return frame;
}

/** The ends [x, y] of the beams of a frame's scan that met something, each from where the robot believed to be then. */
function scanPoints(run, frame) {
  const { first, step, pause, mount } = run.lidar, number = run.at('scan_of', frame);
  if (!Number.isFinite(number)) return [];
  const begin = run.at('scan_time', number), points = [];
  let pose = null;
  run.row('scan', number).forEach((range, i) => {
    if (!Number.isFinite(range)) return;
    if (!pose || pause) pose = believedPose(run, begin + i * pause);
    const [x, y, heading] = pose, cosine = Math.cos(heading), sine = Math.sin(heading);
    const direction = heading + mount[2] + first + i * step;
    points.push([x + cosine * mount[0] - sine * mount[1] + range * Math.cos(direction),
      y + sine * mount[0] + cosine * mount[1] + range * Math.sin(direction)]);
  });
  return points.filter(([x]) => Number.isFinite(x));
}

class LidarMap extends RunMap {
  recolour() {
    super.recolour();
    for (const name of ['scan', 'detected', 'known']) this.ink[name] = colour(name);
  }

  room() {
    super.room();
    const { map } = this.run.lidar;
    if (!map || !this.layers.map) return;
    for (const { corners, legs, leg_radius: radius } of map.tables) {
      this.path(corners, true);
      this.stroke(this.ink.known, 1, [5, 3]);
      legs.forEach((leg) => { this.disc(leg, radius); this.stroke(this.ink.known, 1.2); });
    }
    for (const { position, radius } of map.pillars) {
      this.disc(position, radius);
      this.stroke(this.ink.known, 1.4, [5, 3]);
    }
    for (const wall of map.walls) {
      this.path([wall.from, wall.to]);
      this.stroke(this.ink.known, 1.4, [5, 3]);
    }
  }

  /** Below people and the robot: the latest scan, and what it shows. */
  trail(frame) {
    super.trail(frame);
    const { context, run, ink, layers } = this, tick = run.tickOf(frame);
    if (layers.scan) {
      const size = layers.follow ? 3 : 2.2;
      context.fillStyle = ink.scan;
      for (const point of scanPoints(run, tick)) {
        const [x, y] = this.at(point);
        context.fillRect(x - size / 2, y - size / 2, size, size);
      }
    }
    if (!layers.detections) return;
    const found = run.row('detected', scanFrame(run, tick));
    for (let i = 0; i < found.length; i += 6) {
      const [x, y, radius] = found.subarray(i, i + 3);
      if (!Number.isFinite(x)) continue;
      this.disc([x, y], radius, ink.detected, 0.15);
      this.ellipse(found, x, y, i + 3, ink.detected, []);
    }
  }

  /** Where a robot that is lost believes to be. */
  robot(frame) {
    super.robot(frame);
    const { run, ink } = this, [x, y, heading] = run.row('estimate', run.tickOf(frame)), pose = run.row('pose', frame);
    const { radius } = run.scene;
    if (!(Math.hypot(pose[0] - x, pose[1] - y) > LOST)) return;
    this.disc([x, y], radius);
    this.stroke(ink.robot, 1.6, [4, 3]);
    this.path([[x, y], [x + radius * Math.cos(heading), y + radius * Math.sin(heading)]]);
    this.stroke(ink.robot, 1.6);
    this.label('believed', [x, y], radius * this.scale, ink.robot);
  }

  /** Tracks with their numbers and ages; dashed while nothing is seen of them. */
  tracks(frame) {
    super.tracks(frame);
    const { run, ink } = this, tick = run.tickOf(frame), lives = run.row('life', tick), tracks = run.row('tracks', tick);
    if (!this.layers.estimates) return;
    const few = run.tracks.filter((_, i) => Number.isFinite(lives[4 * i])).length <= FEW_TRACKS;
    for (let i = 0; i < run.tracks.length; i++) {
      const [number, age, unseen, radius] = lives.subarray(4 * i, 4 * i + 4);
      if (!Number.isFinite(number)) continue;
      const place = [tracks[5 * i], tracks[5 * i + 1]];
      const coasts = unseen > run.lidar.longest - 0.01;
      this.disc(place, radius);
      this.stroke(ink.ink, coasts ? 1 : 1.6, coasts ? [3, 3] : []);
      const life = ` ${quantity(age, 0, 's')}${coasts ? `, unseen ${quantity(unseen, 1, 's')}` : ''}`;
      this.label(`t${Math.round(number)}${few ? life : ''}`, place, radius * this.scale, ink.ink, 0);
    }
  }
}
