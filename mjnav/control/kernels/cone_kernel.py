"""Compiled loops over the constraint samples of one decision: f of all pairs of samples at all controls.

Their arguments are named tuples of arrays and numbers. Those without types are called in every decision of the methods
that need them: the warm-up of a run compiles them, and runs by other methods do without.

The loops over single rows compute f of one pair of samples at all controls, or of one sample at one control against all
of the robot's. The innermost loop runs over the controls: a pair of samples is then a handful of constants, and even an
obstacle with one sample fills the vector units. For discs, lengths come multiplied by sqrt(unit) and, in the segment
form, times divided by the horizon, so that the innermost loop needs neither.

What was measured for 402 controls, 5 discs of 625 pairs each and degree 3, on Zen 4 with AVX-512, as ratios of times to
`cone_moments` below (benchmarks/test_kernel_bound.py says how much of the machine's arithmetic that uses):

    1.75   pairs outside with the robot's samples fastest, whose velocities (N, K) are then read from the second cache;
           f = R^2 - |r + t q|^2 with t = -r.q / |q|^2 clipped afterwards; every f times unit; powers row by row
    1.2    the robot's samples outermost, and the closest point r + t q; 1.1 with t clipped after the division
    1.1    a select for |q| < 1e-9 in the innermost loop; with a finite horizon nothing depends on it
    1.4    256-bit vectors
    1.37   the division in float32, which loses nothing (f is stationary in t): converting costs more than it saves
    1.1    tiles of 128 or 256 controls; for 1602 controls 0.95
    0.97   two pairs at once with their powers summed in registers, also with one division for both, 1 / (a b); 0.93
           with four: not worth a loop for every form and degree
    0.49   all in float32, summed over a robot sample and then in float64: costs differ by up to 1.5e-4 of themselves,
           and the choice in 4 of 2239 random and recorded decisions, by a cost of up to 2.5e-5; at degree 1 in 3, all
           of them ties
"""

from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Indices, Matrix, Vector, kernel, scalar
from mjnav.constraints.collision_cone import LINE, RAY, SEGMENT, cone_line, cone_ray, cone_segment
from mjnav.constraints.walls import wall_segment
from mjnav.messages import Array

# ------------------------------------------------------------------------------------------ arguments


class ConeBlocks(NamedTuple):
    """The discs and walls in reach, a block each, discs first: structure of arrays.

    Disc b has the samples start[b] ... start[b + 1] - 1, each of which makes a pair with each of the robot's N; a wall
    counts as one sample, and its two ends are in `wall`.
    """

    column: Indices  # (B,) the block's column in CandidateCosts.cone
    start: Indices  # (B + 1,)
    num_discs: int
    position: Matrix  # (S, 2) [m] samples of the discs
    velocity: Matrix  # (S, 2) [m/s]
    radius_squared: Vector  # (B,) R^2
    unit: Vector  # (B,) what f is multiplied by
    wall: Matrix  # (B, 4) ax, ay, bx, by


class ConeRule(NamedTuple):
    """How f is computed: the form's number, time bounds [s], and the value below which f is cut off."""

    form: int
    horizon: float
    wall_horizon: float
    floor: float  # - clip, or -inf


class RobotSamples(NamedTuple):
    """N samples of the robot's state and of its actuation noise."""

    position: Matrix  # (N, 2) [m]
    speed_noise: Vector  # (N,) [m/s] dv_i
    cos_heading: Vector  # (N,) of theta_i + domega_i tau
    sin_heading: Vector


class Controls(NamedTuple):
    """K controls."""

    v: Vector  # (K,) [m/s]
    cos_turn: Vector  # (K,) of omega tau
    sin_turn: Vector


class Samples(NamedTuple):
    """The samples of one constraint, (n, K) in whole: only rows that are not at the floor at all controls are stored.

    In a crowd these are few: most pairs of samples cannot meet whatever the control. Where none is stored, K may be 1:
    one control stands for all.
    """

    f: Matrix  # (s, K) the rows that are stored, in their order
    row: Indices  # (s,) their numbers, from 0 to n - 1
    num: int  # n
    floor: float

    @classmethod
    def of(cls, samples: Array) -> "Samples":
        """All of the samples (n, K)."""
        return cls(np.ascontiguousarray(samples), np.arange(len(samples)), len(samples), 0.0)

    def whole(self) -> Array:
        """All samples, (n, K)."""
        whole = np.full((self.num, self.f.shape[1]), self.floor)
        whole[self.row] = self.f
        return whole


# --------------------------------------------------------------------------------------- one row of f


@scalar
def units(b, blocks, rule):
    """What the lengths and the velocities of block b are multiplied by."""
    if b >= blocks.num_discs:
        return 1.0, 1.0
    length = np.sqrt(blocks.unit[b])
    return length, length * rule.horizon if rule.form == SEGMENT else length


@kernel
def _disc_row(f, total, vx, vy, x, y, ovx, ovy, radius_squared, form, floor):
    """f of one pair at all controls into `f` (K,), and added to `total`; vx, vy (K,): its robot sample's velocity."""
    if form == LINE:
        for k in range(f.size):
            f[k] = max(cone_line(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, 1.0), floor)
            total[k] += f[k]
    elif form == RAY:
        for k in range(f.size):
            f[k] = max(cone_ray(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, 1.0), floor)
            total[k] += f[k]
    else:
        for k in range(f.size):
            f[k] = max(cone_segment(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, 1.0), floor)
            total[k] += f[k]


@kernel
def _wall_row(f, total, vx, vy, x, y, ax, ay, bx, by, radius_squared, unit, horizon, floor):
    """f of one position and one wall at all controls into `f` (K,), and added to `total`."""
    for k in range(f.size):
        f[k] = max(unit * wall_segment(x, y, vx[k], vy[k], ax, ay, bx, by, radius_squared, horizon), floor)
        total[k] += f[k]


@scalar
def fill_row(f, total, vx, vy, x, y, m, b, length, speed, blocks, rule, floor):
    """f of a robot sample at (x, y) and sample m, which is in block b, at all controls into `f`; added to `total`."""
    if b < blocks.num_discs:
        _disc_row(
            f, total, vx, vy,
            length * (x - blocks.position[m, 0]), length * (y - blocks.position[m, 1]),
            speed * blocks.velocity[m, 0], speed * blocks.velocity[m, 1],
            blocks.unit[b] * blocks.radius_squared[b], rule.form, floor,
        )  # fmt: skip
    else:
        _wall_row(
            f, total, vx, vy, x, y, blocks.wall[b, 0], blocks.wall[b, 1], blocks.wall[b, 2], blocks.wall[b, 3],
            blocks.radius_squared[b], blocks.unit[b], rule.wall_horizon, floor,
        )  # fmt: skip


@kernel
def velocity_row(vx, vy, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading):
    """The velocity of one robot sample at all controls, by the addition theorems."""
    for k in range(v.size):
        speed = v[k] + speed_noise
        vx[k] = speed * (cos_heading * cos_turn[k] - sin_heading * sin_turn[k])
        vy[k] = speed * (sin_heading * cos_turn[k] + cos_heading * sin_turn[k])


@kernel
def _circle(x, y, scale):
    """A circle around all points scale (x, y): centre x, centre y, radius."""
    left = bottom = np.inf
    right = top = -np.inf
    for k in range(x.size):
        left, right = min(left, scale[k] * x[k]), max(right, scale[k] * x[k])
        bottom, top = min(bottom, scale[k] * y[k]), max(top, scale[k] * y[k])
    cx, cy, squared = 0.5 * (left + right), 0.5 * (bottom + top), 0.0
    for k in range(x.size):
        squared = max(squared, (scale[k] * x[k] - cx) ** 2 + (scale[k] * y[k] - cy) ** 2)
    return cx, cy, np.sqrt(squared)


@kernel
def velocity_circles(controls: Controls, robot: RobotSamples):
    """For each robot sample a circle around its velocities at all controls, (N, 3): centre, radius.

    Turned back by its heading they are v e + dv_i e with e = [cos(omega tau), sin(omega tau)]: the sum of a point in
    the circle around all v e and of dv_i times one in the circle around all e.
    """
    ex, ey, e_radius = _circle(controls.cos_turn, controls.sin_turn, np.ones(controls.v.size))
    vx, vy, v_radius = _circle(controls.cos_turn, controls.sin_turn, controls.v)
    out = np.empty((robot.speed_noise.size, 3))
    for i in range(len(out)):
        dv, c, s = robot.speed_noise[i], robot.cos_heading[i], robot.sin_heading[i]
        x, y = vx + dv * ex, vy + dv * ey
        out[i, 0], out[i, 1], out[i, 2] = c * x - s * y, s * x + c * y, v_radius + abs(dv) * e_radius
    return out


@kernel
def reach_of(radius_squared, floor):
    """The distance beyond which f is cut off at the floor."""
    return (1.0 + 1e-9) * np.sqrt(radius_squared - floor)


@kernel
def mark_near(near, circle, x, y, position, velocity, length, speed, reach):
    """Which samples of a disc, (M,) each, come within `reach` of a robot sample for some velocity in its circle.

    |r + t (q + e)| >= |r + t q| - |e| for t from 0 to 1, the horizon. The others' f is the floor, exactly. Returns
    how many are near.
    """
    num_near = 0
    for m in range(near.size):
        squared = -cone_segment(
            length * (x - position[m, 0]), length * (y - position[m, 1]),
            speed * (circle[0] - velocity[m, 0]), speed * (circle[1] - velocity[m, 1]), 0.0, 1.0,
        )  # fmt: skip
        near[m] = squared <= (reach + speed * circle[2]) ** 2
        num_near += near[m]
    return num_near


@kernel
def disc_column(f, vx, vy, position, x, y, ovx, ovy, length, radius_squared, form):
    """f of one sample of a disc against all of the robot's at one control into `f` (N,); x, y, position unscaled."""
    if form == LINE:
        for i in range(f.size):
            rx, ry = length * (position[i, 0] - x), length * (position[i, 1] - y)
            f[i] = cone_line(rx, ry, vx[i] - ovx, vy[i] - ovy, radius_squared, 1.0)
    elif form == RAY:
        for i in range(f.size):
            rx, ry = length * (position[i, 0] - x), length * (position[i, 1] - y)
            f[i] = cone_ray(rx, ry, vx[i] - ovx, vy[i] - ovy, radius_squared, 1.0)
    else:
        for i in range(f.size):
            rx, ry = length * (position[i, 0] - x), length * (position[i, 1] - y)
            f[i] = cone_segment(rx, ry, vx[i] - ovx, vy[i] - ovy, radius_squared, 1.0)


@kernel
def wall_column(f, vx, vy, position, ax, ay, bx, by, radius_squared, unit, horizon):
    """f of one wall against all of the robot's samples at one control into `f` (N,)."""
    for i in range(f.size):
        x, y = position[i, 0], position[i, 1]
        f[i] = unit * wall_segment(x, y, vx[i], vy[i], ax, ay, bx, by, radius_squared, horizon)


# ------------------------------------------------------------------------------- all pairs of samples


ROWS = 4  # rows of f whose powers are added up together: the sums are then loaded and stored once for all of them
LANES = 8  # float64 in the widest vector register. Rows are a multiple of it long, so that none has a remainder


@kernel
def _add_powers(sums, rows):
    """Adds f^p, p = 2 ... degree, of all ROWS rows of f to `sums` (degree, K)."""
    degree = sums.shape[0]
    if degree == 2:
        second = sums[1]
        for k in range(second.size):
            two = 0.0
            for r in range(ROWS):
                two += rows[r, k] * rows[r, k]
            second[k] += two
    elif degree > 2:
        second, third = sums[1], sums[2]
        for k in range(second.size):
            two = three = 0.0
            for r in range(ROWS):
                square = rows[r, k] * rows[r, k]
                two += square
                three += square * rows[r, k]
            second[k] += two
            third[k] += three
    for p in range(4, degree + 1):
        for r in range(ROWS):
            for k in range(sums.shape[1]):
                sums[p - 1, k] += rows[r, k] ** p


@kernel
def cone_moments(out, hinge, circles, controls, robot, blocks, rule):
    """Means of f^p, p = 1 ... degree, into `out` (B, degree, K); of max(0, f)^p for the blocks in `hinge` (B,)."""
    num_blocks, degree, num_controls = out.shape
    num_samples = robot.speed_noise.size
    width = (num_controls + LANES - 1) // LANES * LANES
    scratch = np.zeros((degree + ROWS + 2, width))
    sums, rows, vx, vy = scratch[:degree], scratch[degree:-2], scratch[-2], scratch[-1]
    all_near = np.ones(len(blocks.position) + 1, np.bool_)
    for b in range(num_blocks):
        sums[:] = 0.0
        least = max(rule.floor, 0.0) if hinge[b] else rule.floor
        length, speed = units(b, blocks, rule)
        first, last = blocks.start[b], blocks.start[b + 1]
        near = all_near[: last - first]
        near[:] = True
        bounded = b < blocks.num_discs and rule.form == SEGMENT
        reach = reach_of(blocks.unit[b] * blocks.radius_squared[b], least)
        num_far = filled = 0
        for i in range(num_samples):
            x, y = robot.position[i, 0], robot.position[i, 1]
            if bounded:
                num_near = mark_near(
                    near, circles[i], x, y, blocks.position[first:last], blocks.velocity[first:last],
                    length, speed, reach,
                )  # fmt: skip
                num_far += near.size - num_near
                if num_near == 0:
                    continue
            velocity_row(
                vx, vy, controls.v, controls.cos_turn, controls.sin_turn,
                robot.speed_noise[i], speed * robot.cos_heading[i], speed * robot.sin_heading[i],
            )  # fmt: skip
            for m in range(first, last):
                if near[m - first]:
                    fill_row(rows[filled], sums[0], vx, vy, x, y, m, b, length, speed, blocks, rule, least)
                    filled += 1
                    if filled == ROWS:
                        _add_powers(sums, rows)
                        filled = 0
        if filled > 0:
            rows[filled:] = 0.0
            _add_powers(sums, rows)
        count = num_samples * (last - first)
        power = 1.0
        for p in range(degree):
            power *= least
            # Not least^p times 0: that is not a number where nothing is clipped.
            far = num_far * power if num_far > 0 else 0.0
            for k in range(num_controls):
                out[b, p, k] = (sums[p, k] + far) / count


@kernel
def mean_violation(out, shifts, circles, controls, robot, blocks, rule):
    """sum_b max(0, f_b) of one robot sample, moved by each of `shifts` (P, 2), into `out` (P, K).

    Every block has one sample.
    """
    scratch = np.empty((3, controls.v.size))
    f, vx, vy = scratch[0], scratch[1], scratch[2]
    near = np.ones(1, np.bool_)
    out[:] = 0.0
    for b in range(blocks.unit.size):
        length, speed = units(b, blocks, rule)
        velocity_row(
            vx, vy, controls.v, controls.cos_turn, controls.sin_turn,
            robot.speed_noise[0], speed * robot.cos_heading[0], speed * robot.sin_heading[0],
        )  # fmt: skip
        bounded = b < blocks.num_discs and rule.form == SEGMENT
        reach = reach_of(blocks.unit[b] * blocks.radius_squared[b], 0.0)
        for p in range(len(shifts)):
            x, y = robot.position[0, 0] + shifts[p, 0], robot.position[0, 1] + shifts[p, 1]
            if bounded and not mark_near(
                near, circles[0], x, y, blocks.position[b : b + 1], blocks.velocity[b : b + 1], length, speed, reach
            ):
                continue
            fill_row(f, out[p], vx, vy, x, y, b, b, length, speed, blocks, rule, 0.0)


@kernel
def cone_samples(
    out: Matrix,
    row: Indices,
    b: int,
    circles: Matrix,
    controls: Controls,
    robot: RobotSamples,
    blocks: ConeBlocks,
    rule: ConeRule,
):
    """f of block b at all controls into the first rows of `out` (n, K), the robot's samples running fastest.

    Pairs that are at the floor whatever the control are left out. Returns how many are left; `row` has their numbers.
    """
    num_samples = robot.speed_noise.size
    length, speed = units(b, blocks, rule)
    first, last = blocks.start[b], blocks.start[b + 1]
    near = np.ones((num_samples, last - first), np.bool_)
    num_near = np.full(num_samples, last - first)
    if b < blocks.num_discs and rule.form == SEGMENT:
        reach = reach_of(blocks.unit[b] * blocks.radius_squared[b], rule.floor)
        for i in range(num_samples):
            num_near[i] = mark_near(
                near[i], circles[i], robot.position[i, 0], robot.position[i, 1],
                blocks.position[first:last], blocks.velocity[first:last], length, speed, reach,
            )  # fmt: skip
    place, count = np.empty((num_samples, last - first), np.int64), 0
    for m in range(last - first):
        for i in range(num_samples):
            if near[i, m]:
                place[i, m], row[count] = count, m * num_samples + i
                count += 1
    scratch = np.zeros((3, controls.v.size))
    vx, vy, total = scratch[0], scratch[1], scratch[2]
    for i in range(num_samples):
        if num_near[i] == 0:
            continue
        x, y = robot.position[i, 0], robot.position[i, 1]
        velocity_row(
            vx, vy, controls.v, controls.cos_turn, controls.sin_turn,
            robot.speed_noise[i], speed * robot.cos_heading[i], speed * robot.sin_heading[i],
        )  # fmt: skip
        for m in range(first, last):
            if near[i, m - first]:
                fill_row(out[place[i, m - first]], total, vx, vy, x, y, m, b, length, speed, blocks, rule, rule.floor)
    return count


@kernel
def add_safe(sums, counts, wanted, controls, robot, blocks, rule):
    """Adds up the safe samples of the `wanted` blocks (B,): f^p to `sums` (B, degree), their number to `counts` (B,).

    For a handful of controls: here the robot's samples fill the vector units.
    """
    scratch = np.empty((4, robot.speed_noise.size))
    f, power, vx, vy = scratch[0], scratch[1], scratch[2], scratch[3]
    for b in range(sums.shape[0]):
        if not wanted[b]:
            continue
        length, speed = units(b, blocks, rule)
        rr, unit = blocks.radius_squared[b], blocks.unit[b]
        for k in range(controls.v.size):
            for i in range(f.size):
                v = speed * (controls.v[k] + robot.speed_noise[i])
                vx[i] = v * (robot.cos_heading[i] * controls.cos_turn[k] - robot.sin_heading[i] * controls.sin_turn[k])
                vy[i] = v * (robot.sin_heading[i] * controls.cos_turn[k] + robot.cos_heading[i] * controls.sin_turn[k])
            for m in range(blocks.start[b], blocks.start[b + 1]):
                if b < blocks.num_discs:
                    disc_column(
                        f, vx, vy, robot.position, blocks.position[m, 0], blocks.position[m, 1],
                        speed * blocks.velocity[m, 0], speed * blocks.velocity[m, 1], length, unit * rr, rule.form,
                    )  # fmt: skip
                else:
                    ax, ay, bx, by = blocks.wall[b, 0], blocks.wall[b, 1], blocks.wall[b, 2], blocks.wall[b, 3]
                    wall_column(f, vx, vy, robot.position, ax, ay, bx, by, rr, unit, rule.wall_horizon)
                num_safe = 0
                for i in range(f.size):
                    num_safe += f[i] <= 0.0
                    f[i] = max(f[i], rule.floor) if f[i] <= 0.0 else 0.0
                    power[i] = 1.0
                counts[b] += num_safe
                for p in range(sums.shape[1]):
                    total = 0.0
                    for i in range(f.size):
                        power[i] *= f[i]
                        total += power[i]
                    sums[b, p] += total
