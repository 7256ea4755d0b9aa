"""The samples of every constraint for every candidate: the one kernel that all sample-based methods share.

For candidate k with control (v, omega), robot sample i moves at

    x'_i(k) = (v + dv_i) [cos(theta_i + (omega + domega_i) tau), sin(...)],

and against sample m of obstacle j the constraint is f(p_i - o_m, x'_i(k) - o'_m, R_j). Pairs are laid out with the
robot's samples running fastest (pair n = m N + i), so that the velocities of one candidate, repeated, serve every
obstacle whatever its number of samples. Then f is divided by R_j^2 where `normalise` says so, and none counts as safer
than the clip.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.constraints.collision_cone import LINE, RAY, cone_line, cone_ray, cone_segment
from mjnav.constraints.compiled import kernel
from mjnav.constraints.wall import wall_segment
from mjnav.messages import Array


@dataclass(frozen=True, slots=True)
class ConeBlocks:
    """The pairs of all discs and walls in reach, one block after another: structure of arrays.

    Block b holds pairs start[b] ... start[b + 1] - 1. Discs come first. A wall's block holds the robot's N positions in
    (x, y) and its two ends, constant, in `wall`.
    """

    column: np.ndarray  # (B,) int: the block's column in CandidateCosts.cone
    start: np.ndarray  # (B + 1,) int
    num_discs: int
    x: Array  # (n,) relative position, or the robot's for a wall
    y: Array
    vx: Array  # (n,) the obstacle's velocity
    vy: Array
    radius_squared: Array  # (B,) R^2
    unit: Array  # (B,) what f is multiplied by
    wall: Array  # (B, 4) ax, ay, bx, by


@dataclass(frozen=True, slots=True)
class ConeRule:
    """How f is computed: the form's number, time bounds [s], and the value below which f is cut off."""

    form: int
    horizon: float
    wall_horizon: float
    floor: float  # - clip, or -inf


@kernel
def fill_block(
    out, blocks_x, blocks_y, blocks_vx, blocks_vy, begin, vx, vy, radius_squared, unit, form, horizon, floor
):
    """f of one block of disc pairs into `out`; vx, vy are the robot's, repeated at least as often as needed."""
    n = out.size
    x = blocks_x[begin : begin + n]
    y = blocks_y[begin : begin + n]
    ox = blocks_vx[begin : begin + n]
    oy = blocks_vy[begin : begin + n]
    if form == LINE:
        for i in range(n):
            f = cone_line(x[i], y[i], vx[i] - ox[i], vy[i] - oy[i], radius_squared, horizon)
            out[i] = max(f * unit, floor)
    elif form == RAY:
        for i in range(n):
            f = cone_ray(x[i], y[i], vx[i] - ox[i], vy[i] - oy[i], radius_squared, horizon)
            out[i] = max(f * unit, floor)
    else:
        for i in range(n):
            f = cone_segment(x[i], y[i], vx[i] - ox[i], vy[i] - oy[i], radius_squared, horizon)
            out[i] = max(f * unit, floor)


@kernel
def fill_wall(out, blocks_x, blocks_y, begin, vx, vy, wall, radius_squared, unit, horizon, floor):
    """f of one wall's block into `out`."""
    n = out.size
    x = blocks_x[begin : begin + n]
    y = blocks_y[begin : begin + n]
    ax, ay, bx, by = wall[0], wall[1], wall[2], wall[3]
    for i in range(n):
        f = wall_segment(x[i], y[i], vx[i], vy[i], ax, ay, bx, by, radius_squared, horizon)
        out[i] = max(f * unit, floor)


@kernel
def robot_velocities(vx, vy, num_samples, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading):
    """The samples' velocities at one candidate into vx, vy (n,), repeated to fill them.

    cos(a + b) = cos a cos b - sin a sin b, with a = theta_i + domega_i tau and b = omega tau.
    """
    for i in range(num_samples):
        speed = v + speed_noise[i]
        vx[i] = speed * (cos_heading[i] * cos_turn - sin_heading[i] * sin_turn)
        vy[i] = speed * (sin_heading[i] * cos_turn + cos_heading[i] * sin_turn)
    for i in range(num_samples, vx.size):
        vx[i] = vx[i - num_samples]
        vy[i] = vy[i - num_samples]


@kernel
def fill_any(out, b, x, y, ovx, ovy, start, num_discs, vx, vy, radius_squared, unit, wall, form, horizons, floor):
    """f of block `b`, disc or wall, into `out` (start[b + 1] - start[b],)."""
    if b < num_discs:
        fill_block(out, x, y, ovx, ovy, start[b], vx, vy, radius_squared[b], unit[b], form, horizons[0], floor)
    else:
        fill_wall(out, x, y, start[b], vx, vy, wall[b], radius_squared[b], unit[b], horizons[1], floor)


@kernel
def _moments(
    out, hinge, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading,
    x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor, longest,
):  # fmt: skip
    num_samples = speed_noise.size
    degree = out.shape[2]
    vx = np.empty(longest)
    vy = np.empty(longest)
    buffer = np.empty(longest)
    for k in range(out.shape[0]):
        robot_velocities(vx, vy, num_samples, v[k], cos_turn[k], sin_turn[k], speed_noise, cos_heading, sin_heading)
        for b in range(out.shape[1]):
            n = start[b + 1] - start[b]
            f = buffer[:n]
            fill_any(f, b, x, y, ovx, ovy, start, num_discs, vx, vy, radius_squared, unit, wall, form, horizons, floor)
            if hinge[b]:
                for i in range(n):
                    f[i] = max(f[i], 0.0)
            _power_means(out[k, b], f, degree)


@kernel
def _power_means(out, f, degree):
    """Means of f^1 ... f^degree into `out`."""
    n = f.size
    s1 = 0.0
    s2 = 0.0
    s3 = 0.0
    if degree == 1:
        for i in range(n):
            s1 += f[i]
    elif degree == 2:
        for i in range(n):
            s1 += f[i]
            s2 += f[i] * f[i]
    else:
        for i in range(n):
            square = f[i] * f[i]
            s1 += f[i]
            s2 += square
            s3 += square * f[i]
    out[0] = s1 / n
    if degree >= 2:
        out[1] = s2 / n
    if degree >= 3:
        out[2] = s3 / n
    for p in range(4, degree + 1):
        s = 0.0
        for i in range(n):
            s += f[i] ** p
        out[p - 1] = s / n


@kernel
def _samples(
    out, b, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading,
    x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor,
):  # fmt: skip
    vx = np.empty(max(out.size, speed_noise.size))
    vy = np.empty(max(out.size, speed_noise.size))
    robot_velocities(vx, vy, speed_noise.size, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading)
    fill_any(out, b, x, y, ovx, ovy, start, num_discs, vx, vy, radius_squared, unit, wall, form, horizons, floor)


@kernel
def _add_safe(
    sums, counts, wanted, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading,
    x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor, longest,
):  # fmt: skip
    vx = np.empty(longest)
    vy = np.empty(longest)
    buffer = np.empty(longest)
    for k in range(v.size):
        robot_velocities(
            vx, vy, speed_noise.size, v[k], cos_turn[k], sin_turn[k], speed_noise, cos_heading, sin_heading
        )
        for b in range(sums.shape[0]):
            if not wanted[b]:
                continue
            f = buffer[: start[b + 1] - start[b]]
            fill_any(f, b, x, y, ovx, ovy, start, num_discs, vx, vy, radius_squared, unit, wall, form, horizons, floor)
            for i in range(f.size):
                if f[i] <= 0.0:
                    counts[b] += 1
                    power = 1.0
                    for p in range(sums.shape[1]):
                        power *= f[i]
                        sums[b, p] += power


@dataclass(frozen=True, slots=True)
class SampleCone:
    """All constraint samples of one observation, ready to be evaluated at candidates."""

    blocks: ConeBlocks
    rule: ConeRule
    preview: float  # [s] tau
    speed_noise: Array  # (N,)
    cos_heading: Array  # (N,) of theta_i + domega_i tau
    sin_heading: Array

    @classmethod
    def of(cls, blocks: ConeBlocks, rule: ConeRule, robot_pose: Array, control_noise: Array, preview: float):
        """From the robot's samples (N, 3) and their actuation noise (N, 2)."""
        heading = robot_pose[:, 2] + control_noise[:, 1] * preview
        return cls(
            blocks, rule, preview, np.ascontiguousarray(control_noise[:, 0]), np.cos(heading), np.sin(heading)
        )  # fmt: skip

    def _arguments(self) -> tuple:
        """What every kernel takes, in its order."""
        b, rule = self.blocks, self.rule
        return (
            self.speed_noise, self.cos_heading, self.sin_heading,
            b.x, b.y, b.vx, b.vy, b.start, b.num_discs, b.radius_squared, b.unit, b.wall,
            rule.form, (rule.horizon, rule.wall_horizon), rule.floor,
        )  # fmt: skip

    def _longest(self) -> int:
        """Pairs of the largest block, and at least the robot's samples."""
        return max(int(np.diff(self.blocks.start).max(initial=0)), self.speed_noise.size)

    def moments(self, v: Array, omega: Array, degree: int, hinge: np.ndarray) -> Array:
        """Means of f^p, p = 1 ... degree, for candidates (K,) and all blocks: (K, B, degree).

        Where hinge[b] is set, of max(0, f)^p.
        """
        out = np.empty((v.size, self.blocks.column.size, degree))
        turn = omega * self.preview
        _moments(out, hinge, v, np.cos(turn), np.sin(turn), *self._arguments(), self._longest())
        return out

    def samples(self, block: int, v: float, omega: float) -> Array:
        """f of one block at one control, (n,)."""
        b = self.blocks
        out = np.empty(int(b.start[block + 1] - b.start[block]))
        turn = omega * self.preview
        _samples(out, block, v, np.cos(turn), np.sin(turn), *self._arguments())
        return out

    def add_safe(self, sums: Array, counts: np.ndarray, wanted: np.ndarray, v: Array, omega: Array) -> None:
        """Adds what is safe at the controls (K,): sums of f^p, p = 1 ... degree, to `sums` (B, degree), numbers to
        `counts` (B,), for the blocks that are `wanted` (B,).
        """
        turn = omega * self.preview
        _add_safe(
            sums, counts, wanted, v, np.cos(turn), np.sin(turn), *self._arguments(), self._longest()
        )  # fmt: skip
