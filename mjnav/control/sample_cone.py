"""The samples of every constraint for every candidate: the one kernel that all sample-based methods share.

For candidate k with control (v, omega), robot sample i moves at

    x'_i(k) = (v + dv_i) [cos(theta_i + (omega + domega_i) tau), sin(...)],

and against sample m of obstacle j the constraint is f(p_i - o_m, x'_i(k) - o'_m, R_j). Then f is divided by R_j^2
where `normalise` says so, and none counts as safer than the clip. The innermost loop runs over the candidates: a pair
of samples is then a handful of constants, and even an obstacle with one sample fills the vector units.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjnav.constraints.collision_cone import LINE, RAY, SEGMENT, cone_line, cone_ray, cone_segment
from mjnav.constraints.compiled import kernel
from mjnav.constraints.wall import wall_segment
from mjnav.messages import Array


@dataclass(frozen=True, slots=True)
class ConeBlocks:
    """The pairs of all discs and walls in reach, one block after another: structure of arrays.

    Block b holds pairs start[b] ... start[b + 1] - 1, the robot's N samples running fastest: pair m N + i. Discs come
    first. A wall's block holds the robot's N positions in (x, y), and its two ends stand in `wall`.
    """

    column: NDArray[np.int64]  # (B,) the block's column in CandidateCosts.cone
    start: NDArray[np.int64]  # (B + 1,)
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
def _fill_disc(out, vx, vy, x, y, ovx, ovy, radius_squared, unit, form, horizon, floor):
    """f of one pair at all candidates into `out` (K,); vx, vy (K,) are the velocities of the pair's robot sample."""
    if form == LINE:
        for k in range(out.size):
            f = cone_line(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, horizon)
            out[k] = max(f * unit, floor)
    elif form == RAY:
        for k in range(out.size):
            f = cone_ray(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, horizon)
            out[k] = max(f * unit, floor)
    else:
        for k in range(out.size):
            f = cone_segment(x, y, vx[k] - ovx, vy[k] - ovy, radius_squared, horizon)
            out[k] = max(f * unit, floor)


@kernel
def _fill_wall(out, vx, vy, x, y, ax, ay, bx, by, radius_squared, unit, horizon, floor):
    """f of one position and one wall at all candidates into `out` (K,)."""
    for k in range(out.size):
        f = wall_segment(x, y, vx[k], vy[k], ax, ay, bx, by, radius_squared, horizon)
        out[k] = max(f * unit, floor)


@kernel
def _fill(out, b, n, vx, vy, x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor):
    """f of pair n, which is in block b, at all candidates into `out` (K,)."""
    i = (n - start[b]) % vx.shape[0]
    rr, u = radius_squared[b], unit[b]
    if b < num_discs:
        _fill_disc(out, vx[i], vy[i], x[n], y[n], ovx[n], ovy[n], rr, u, form, horizons[0], floor)
    else:
        ax, ay, bx, by = wall[b, 0], wall[b, 1], wall[b, 2], wall[b, 3]
        _fill_wall(out, vx[i], vy[i], x[n], y[n], ax, ay, bx, by, rr, u, horizons[1], floor)


@kernel
def _velocities(v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading):
    """The robot samples' velocities at all candidates, (N, K) each, by the addition theorems."""
    vx = np.empty((speed_noise.size, v.size))
    vy = np.empty((speed_noise.size, v.size))
    for i in range(speed_noise.size):
        for k in range(v.size):
            speed = v[k] + speed_noise[i]
            vx[i, k] = speed * (cos_heading[i] * cos_turn[k] - sin_heading[i] * sin_turn[k])
            vy[i, k] = speed * (sin_heading[i] * cos_turn[k] + cos_heading[i] * sin_turn[k])
    return vx, vy


@kernel
def _spread(vx, vy):
    """For each robot sample the middle of its velocities at all candidates, and the farthest from it: (N, 3)."""
    middle = np.empty((vx.shape[0], 3))
    for i in range(vx.shape[0]):
        cx, cy = 0.5 * (vx[i].min() + vx[i].max()), 0.5 * (vy[i].min() + vy[i].max())
        farthest = 0.0
        for k in range(vx.shape[1]):
            farthest = max(farthest, (vx[i, k] - cx) ** 2 + (vy[i, k] - cy) ** 2)
        middle[i, 0], middle[i, 1], middle[i, 2] = cx, cy, np.sqrt(farthest)
    return middle


@kernel
def _far_beyond(radius_squared, unit, floor):
    """The distance beyond which f is cut off at the floor."""
    return (1.0 + 1e-9) * np.sqrt(radius_squared - floor / unit)


@kernel
def _is_far(x, y, vx, vy, slack, horizon, cut):
    """Whether a pair stays farther apart than `cut` for every velocity within `slack` of (vx, vy) relative to it.

    |r + t (q + e)| >= |r + t q| - t |e|, and t is at most the horizon.
    """
    nearest = np.sqrt(-cone_segment(x, y, vx, vy, 0.0, horizon))
    return nearest - slack * horizon > cut


@kernel
def _add_powers(sums, f):
    """Adds f^p, p = 1 ... degree, to `sums` (degree, K)."""
    degree = sums.shape[0]
    first, second, third = sums[0], sums[min(degree, 2) - 1], sums[min(degree, 3) - 1]
    if degree == 1:
        for k in range(f.size):
            first[k] += f[k]
    elif degree == 2:
        for k in range(f.size):
            first[k] += f[k]
            second[k] += f[k] * f[k]
    else:
        for k in range(f.size):
            square = f[k] * f[k]
            first[k] += f[k]
            second[k] += square
            third[k] += square * f[k]
    for p in range(4, degree + 1):
        for k in range(f.size):
            sums[p - 1, k] += f[k] ** p


@kernel
def _moments(
    out, hinge, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading,
    x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor,
):  # fmt: skip
    vx, vy = _velocities(v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading)
    middle = _spread(vx, vy)
    num_samples = speed_noise.size
    f = np.empty(v.size)
    sums = np.empty((out.shape[2], v.size))
    for b in range(out.shape[1]):
        sums[:] = 0.0
        least = max(floor, 0.0) if hinge[b] else floor
        # What the clip takes, exactly, is counted, not evaluated.
        cut = _far_beyond(radius_squared[b], unit[b], least)
        bounded = b < num_discs and form == SEGMENT and cut < np.inf and horizons[0] < np.inf
        num_far = 0
        for n in range(start[b], start[b + 1]):
            i = (n - start[b]) % num_samples
            if bounded and _is_far(
                x[n], y[n], middle[i, 0] - ovx[n], middle[i, 1] - ovy[n], middle[i, 2], horizons[0], cut
            ):
                num_far += 1
                continue
            _fill(f, b, n, vx, vy, x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, least)
            _add_powers(sums, f)
        count = start[b + 1] - start[b]
        power = 1.0
        for p in range(out.shape[2]):
            power *= least
            # Not least^p times 0: that is not a number where nothing is clipped.
            far = num_far * power if num_far > 0 else 0.0
            for k in range(v.size):
                out[k, b, p] = (sums[p, k] + far) / count


@kernel
def _samples(
    out, b, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading,
    x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor,
):  # fmt: skip
    """f of block b at all candidates into `out` (n, K); returns how many of its pairs the clip takes everywhere."""
    vx, vy = _velocities(v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading)
    middle = _spread(vx, vy)
    cut = _far_beyond(radius_squared[b], unit[b], floor)
    bounded = b < num_discs and form == SEGMENT and cut < np.inf and horizons[0] < np.inf
    num_far = 0
    for n in range(start[b], start[b + 1]):
        f = out[n - start[b]]
        i = (n - start[b]) % speed_noise.size
        if bounded and _is_far(
            x[n], y[n], middle[i, 0] - ovx[n], middle[i, 1] - ovy[n], middle[i, 2], horizons[0], cut
        ):
            f[:] = floor
            num_far += 1
        else:
            _fill(f, b, n, vx, vy, x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor)
    return num_far


@kernel
def _add_safe(
    sums, counts, wanted, v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading,
    x, y, ovx, ovy, start, num_discs, radius_squared, unit, wall, form, horizons, floor,
):  # fmt: skip
    # A handful of controls: no loop long enough to vectorise, so every f is computed by itself.
    vx, vy = _velocities(v, cos_turn, sin_turn, speed_noise, cos_heading, sin_heading)
    num_samples = speed_noise.size
    for b in range(sums.shape[0]):
        if not wanted[b]:
            continue
        rr, u = radius_squared[b], unit[b]
        ax, ay, bx, by = wall[b, 0], wall[b, 1], wall[b, 2], wall[b, 3]
        for n in range(start[b], start[b + 1]):
            i = (n - start[b]) % num_samples
            for k in range(v.size):
                if b >= num_discs:
                    f = wall_segment(x[n], y[n], vx[i, k], vy[i, k], ax, ay, bx, by, rr, horizons[1])
                elif form == LINE:
                    f = cone_line(x[n], y[n], vx[i, k] - ovx[n], vy[i, k] - ovy[n], rr, horizons[0])
                elif form == RAY:
                    f = cone_ray(x[n], y[n], vx[i, k] - ovx[n], vy[i, k] - ovy[n], rr, horizons[0])
                else:
                    f = cone_segment(x[n], y[n], vx[i, k] - ovx[n], vy[i, k] - ovy[n], rr, horizons[0])
                if f <= 0.0:
                    f = max(f * u, floor)
                    counts[b] += 1
                    power = 1.0
                    for p in range(sums.shape[1]):
                        power *= f
                        sums[b, p] += power


@dataclass(frozen=True, slots=True)
class SampleCone:
    """All constraint samples of one observation, ready to be evaluated at controls (K,)."""

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
        speed_noise = np.ascontiguousarray(control_noise[:, 0])
        return cls(blocks, rule, preview, speed_noise, np.cos(heading), np.sin(heading))

    def _arguments(self, v: Array, omega: Array) -> tuple:
        """What every kernel takes, in its order."""
        b, rule, turn = self.blocks, self.rule, omega * self.preview
        return (
            v, np.cos(turn), np.sin(turn), self.speed_noise, self.cos_heading, self.sin_heading,
            b.x, b.y, b.vx, b.vy, b.start, b.num_discs, b.radius_squared, b.unit, b.wall,
            rule.form, (rule.horizon, rule.wall_horizon), rule.floor,
        )  # fmt: skip

    def moments(self, v: Array, omega: Array, degree: int, hinge: NDArray[np.bool_]) -> Array:
        """Means of f^p, p = 1 ... degree, for all blocks: (K, B, degree). Where hinge[b] is set, of max(0, f)^p."""
        out = np.empty((v.size, self.blocks.column.size, degree))
        _moments(out, hinge, *self._arguments(v, omega))
        return out

    def samples(self, block: int, v: Array, omega: Array) -> Array:
        """f of one block, (n, K)."""
        out = np.empty((int(self.blocks.start[block + 1] - self.blocks.start[block]), v.size))
        _samples(out, block, *self._arguments(v, omega))
        return out

    def each(self, v: Array, omega: Array, *, hinge: bool = False) -> Iterator[Array]:
        """f of one block after another, (n, K), in memory that the next overwrites; (n, 1) for one out of reach.

        With `hinge` max(0, f), which is less to evaluate.
        """
        sizes = np.diff(self.blocks.start)
        samples = np.empty((int(sizes.max(initial=0)), v.size))
        cone = replace(self, rule=replace(self.rule, floor=max(self.rule.floor, 0.0))) if hinge else self
        arguments = cone._arguments(v, omega)
        for block, size in enumerate(sizes.tolist()):
            num_far = _samples(samples[:size], block, *arguments)
            # Where all samples are alike, one candidate stands for all.
            yield samples[:size] if num_far < size else samples[:size, :1].copy()

    def reduce(self, v: Array, omega: Array, reduction: Callable[[Array], Array], *, hinge: bool = False) -> Array:
        """(K, B): what `reduction` makes of each block's samples (n, K), which `each` gives."""
        out = np.empty((v.size, self.blocks.column.size))
        for block, samples in enumerate(self.each(v, omega, hinge=hinge)):
            out[:, block] = reduction(samples)
        return out

    def add_safe(
        self, sums: Array, counts: NDArray[np.int64], wanted: NDArray[np.bool_], v: Array, omega: Array
    ) -> None:
        """Adds up what is safe, in the blocks that are `wanted` (B,): f^p to `sums` (B, degree), 1 to `counts` (B,)."""
        _add_safe(sums, counts, wanted, *self._arguments(v, omega))
