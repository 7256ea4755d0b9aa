"""The collision probability of rollouts: at every step the share of samples that collide or are beyond a lane boundary.

    P_jt(k) = share of pairs (i, m) with |p_t(k) + e_i - o_m((t + 1) dt)| < R_j,

p_t(k) the mean robot's position at the end of step t of rollout k, e_i where sample i of the robot is beside the mean,
and o_m(s) where sample m of obstacle j is predicted s seconds later: o_m + s o'_m without a prediction of its own. All
N M pairs count. Relative to the mean robot they form one cloud of points, the same for every rollout, and most rollouts
are entirely outside or inside its reach.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mjnav.compile.compiled import Indices, Matrix, Vector, kernel
from mjnav.control.problem.joint_samples import Covering, lane_excesses, robot_offsets
from mjnav.control.problem.obstacles import Discs, Reach, positions_at
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import Rollouts
from mjnav.messages import Array, ObstacleSamples

SLACK = 1e-9  # relative, by which a cloud's reach is rounded up
TINY = 1e-300


@kernel
def _spread(x, y, cx, cy):
    """The greatest distance of points (n,) from (cx, cy)."""
    farthest = 0.0
    for i in range(x.size):
        farthest = max(farthest, (x[i] - cx) ** 2 + (y[i] - cy) ** 2)
    return np.sqrt(farthest)


@kernel
def _differences(out, a, b):
    """a_i - b_m, i running fastest, into `out`."""
    n = a.size
    for m in range(b.size):
        for i in range(n):
            out[m * n + i] = a[i] - b[m]


@kernel
def _share_within(x, y, cloud_x, cloud_y, radius):
    """The share of points c (n,) with |(x, y) + c| < radius."""
    count, radius_squared = 0.0, radius * radius
    for i in range(cloud_x.size):
        dx, dy = x + cloud_x[i], y + cloud_y[i]
        count += 1.0 if dx * dx + dy * dy < radius_squared else 0.0
    return count / cloud_x.size


@kernel
def _num_near(x, y, cx, cy, square):
    """How many of the points (K,) are nearer to (cx, cy) than the root of `square`."""
    count = 0.0
    for k in range(x.size):
        count += 1.0 if (x[k] - cx) ** 2 + (y[k] - cy) ** 2 < square else 0.0
    return count


@kernel
def _count_within(inner, outer, x, y, px, py, radius, spread):
    """How many points p (M,) are within `radius` - `spread`, and `radius` + `spread`, of each point (x, y) (K,)."""
    inner_squared, outer_squared = max(radius - spread, 0.0) ** 2, (radius + spread) ** 2
    inner[:] = 0.0
    outer[:] = 0.0
    for m in range(px.size):
        for k in range(x.size):
            dx, dy = x[k] - px[m], y[k] - py[m]
            distance = dx * dx + dy * dy
            inner[k] += 1.0 if distance < inner_squared else 0.0
            outer[k] += 1.0 if distance < outer_squared else 0.0


@kernel
def _meet_discs(
    time: Matrix,
    worst: Vector,
    x: Matrix,
    y: Matrix,
    ex: Vector,
    ey: Vector,
    ox: Matrix,
    oy: Matrix,
    start: Indices,
    radius: Vector,
    step: float,
):
    """Adds the time in collision with every disc to `time` (B, K); the greatest share goes to `worst` (K,).

    ox, oy (T, S) are the discs' samples at the end of every step.

    With the robot's samples at most r from their mean, all of them collide with a disc's sample that is nearer to that
    mean than R - r, and none with one that is R + r away. Only where a sample of the disc is in between are all pairs
    counted.
    """
    num, num_robot = x.shape[1], ex.size
    mean_ex, mean_ey = ex.mean(), ey.mean()
    robot_spread = _spread(ex, ey, mean_ex, mean_ey)
    near = np.empty(num, np.int64)  # rollouts that come near the disc at this step, and there the robot's mean
    near_x, near_y = np.empty(num), np.empty(num)  # each in memory of its own, or the loops over them do not vectorise
    inner, outer = np.empty(num), np.empty(num)
    for b in range(radius.size):
        m = slice(start[b], start[b + 1])
        n = num_robot * (start[b + 1] - start[b])
        cloud_x, cloud_y = np.empty(n), np.empty(n)
        spread = robot_spread + SLACK * radius[b]
        for t in range(x.shape[0]):
            px, py = ox[t, m], oy[t, m]
            mean_px, mean_py = px.mean(), py.mean()
            cx, cy = mean_px - mean_ex, mean_py - mean_ey
            both = spread + _spread(px, py, mean_px, mean_py)
            outside, inside = (radius[b] + both) ** 2, max(radius[b] - both, 0.0) ** 2
            if _num_near(x[t], y[t], cx, cy, outside) == 0.0:
                continue
            num_near = 0
            for k in range(num):
                if (x[t, k] - cx) ** 2 + (y[t, k] - cy) ** 2 < outside:
                    near[num_near], near_x[num_near], near_y[num_near] = k, x[t, k] + mean_ex, y[t, k] + mean_ey
                    num_near += 1
            _count_within(
                inner[:num_near], outer[:num_near], near_x[:num_near], near_y[:num_near], px, py, radius[b], spread
            )
            known = False
            for i in range(num_near):
                if outer[i] == 0.0:
                    continue
                k, share = near[i], 1.0
                if inner[i] < outer[i]:
                    if not known:
                        _differences(cloud_x, ex, px)
                        _differences(cloud_y, ey, py)
                        known = True
                    share = _share_within(x[t, k], y[t, k], cloud_x, cloud_y, radius[b])
                elif (x[t, k] - cx) ** 2 + (y[t, k] - cy) ** 2 >= inside:
                    share = inner[i] * num_robot / n
                time[b, k] += step * share
                worst[k] = max(worst[k], share)


@kernel
def _num_near_segment(x, y, ax, ay, dx, dy, per_length, square):
    """How many of the points (K,) are nearer to the segment from a along d than the root of `square`."""
    count = 0.0
    for k in range(x.size):
        px, py = x[k] - ax, y[k] - ay
        s = min(max((px * dx + py * dy) * per_length, 0.0), 1.0)
        count += 1.0 if (px - s * dx) ** 2 + (py - s * dy) ** 2 < square else 0.0
    return count


@kernel
def _meet_walls(
    time: Matrix, worst: Vector, x: Matrix, y: Matrix, ex: Vector, ey: Vector, wall: Matrix, radius: float, step: float
):
    """The same for walls: the share of offsets less than `radius` from the segment."""
    spread = _spread(ex, ey, 0.0, 0.0) + SLACK * radius
    outside, inside = (radius + spread) ** 2, max(radius - spread, 0.0) ** 2
    for b in range(wall.shape[0]):
        ax, ay = wall[b, 0], wall[b, 1]
        dx, dy = wall[b, 2] - ax, wall[b, 3] - ay
        per_length = 1.0 / max(dx * dx + dy * dy, TINY)
        for t in range(x.shape[0]):
            if _num_near_segment(x[t], y[t], ax, ay, dx, dy, per_length, outside) == 0.0:
                continue
            for k in range(x.shape[1]):
                px, py = x[t, k] - ax, y[t, k] - ay
                s = min(max((px * dx + py * dy) * per_length, 0.0), 1.0)
                distance = (px - s * dx) ** 2 + (py - s * dy) ** 2
                if distance >= outside:
                    continue
                share = 1.0
                if distance >= inside:
                    count = 0.0
                    for i in range(ex.size):
                        qx, qy = px + ex[i], py + ey[i]
                        s = min(max((qx * dx + qy * dy) * per_length, 0.0), 1.0)
                        count += 1.0 if (qx - s * dx) ** 2 + (qy - s * dy) ** 2 < radius * radius else 0.0
                    share = count / ex.size
                time[b, k] += step * share
                worst[k] = max(worst[k], share)


@kernel
def _cross(time: Vector, worst: Vector, x: Matrix, y: Matrix, normal: Vector, excess: Vector, step: float):
    """The same for a lane boundary: the share of i with normal . (x, y) + excess_i > 0."""
    for t in range(x.shape[0]):
        for k in range(x.shape[1]):
            along = normal[0] * x[t, k] + normal[1] * y[t, k]
            count = 0.0
            for i in range(excess.size):
                count += 1.0 if along + excess[i] > 0.0 else 0.0
            time[k] += step * count / excess.size
            worst[k] = max(worst[k], count / excess.size)


@kernel
def _straight(x: Matrix, y: Matrix, ox: Vector, oy: Vector, ovx: Vector, ovy: Vector, step: float):
    """Where samples (S,) are that go straight on, at the end of every step, into `x` and `y` (T, S)."""
    for t in range(x.shape[0]):
        ahead = (t + 1) * step
        for i in range(ox.size):
            x[t, i] = ox[i] + ahead * ovx[i]
            y[t, i] = oy[i] + ahead * ovy[i]


def _paths(
    obstacles: Sequence[ObstacleSamples], reach: Reach, discs: Discs, mean: Array, times: Array
) -> tuple[Array, Array]:
    """x and y (T, S) of the samples of the discs in reach at `times` (T,), relative to the robot's `mean` position."""
    x, y = np.empty((2, len(times), len(discs.position)))
    position = np.ascontiguousarray((discs.position - mean).T)
    _straight(x, y, *position, *np.ascontiguousarray(discs.velocity.T), float(times[0]))
    for b, j in enumerate(reach.discs):
        if obstacles[j].future is not None:
            rows = slice(discs.start[b], discs.start[b + 1])
            x[:, rows], y[:, rows] = np.moveaxis(positions_at(obstacles[j], times) - mean, -1, 0)
    return x, y


@dataclass(frozen=True, slots=True)
class Risk:
    """The risk of each of K rollouts."""

    cone: Array  # (K, J) expected time in collision with each obstacle, then each wall [s]
    lane: Array  # (K, 2) expected time beyond the left and the right boundary [s]
    worst: Array  # (K,) greatest probability of any one of them, at any one step


@dataclass(frozen=True, slots=True)
class Surroundings:
    """All samples of an observation, relative to the robot's mean position."""

    offsets: Array  # (2, N) [m] of the robot's samples
    start: Indices  # (B + 1,) the samples of disc b are those from start[b] to start[b + 1]
    disc_radius: Array  # (B,) [m]
    paths: tuple[Array, Array]  # x and y (T, S) [m] of the discs' samples at the end of every step
    walls: Array  # (W, 4) [m] ax, ay, bx, by
    columns: list[int]  # of the discs and walls, in Risk.cone
    num_columns: int
    robot: Covering
    lanes: tuple[tuple[Array, Array], ...]  # (2,) outward normal and (N,) samples of what the robot is beyond by [m]

    @classmethod
    def of(cls, problem: Problem, reach: Reach, steps: int, step: float) -> "Surroundings":
        """The discs and walls in reach, by the problem's samples, for `steps` steps of `step` [s]."""
        o, mean, offsets = problem.observation, problem.mean_pose[:2], robot_offsets(problem)
        discs = problem.discs.take(reach.discs)
        paths = _paths(o.obstacles, reach, discs, mean, step * np.arange(1, steps + 1, dtype=float))
        num_discs = len(o.obstacles)
        return cls(
            offsets=offsets,
            start=discs.start,
            disc_radius=discs.radius,
            paths=paths,
            walls=(o.walls[list(reach.walls)] - mean).reshape(-1, 4),
            columns=[*reach.discs, *(num_discs + w for w in reach.walls)],
            num_columns=num_discs + len(o.walls),
            robot=Covering.of(problem),
            lanes=lane_excesses(problem, offsets),
        )

    def risk(self, rollouts: Rollouts) -> Risk:
        """The risk of rollouts here; with each body that of the disc of the robot that has the most."""
        num_discs, num = len(self.disc_radius), rollouts.x.shape[1]
        times, lane, worst = np.zeros((len(self.columns), num)), np.zeros((2, num)), np.zeros(num)
        for r, radius in self.robot.paths(rollouts):
            time = np.zeros_like(times)
            _meet_discs(
                time[:num_discs], worst, r.x, r.y, *self.offsets, *self.paths, self.start,
                self.disc_radius + radius, r.step,
            )  # fmt: skip
            _meet_walls(time[num_discs:], worst, r.x, r.y, *self.offsets, self.walls, radius, r.step)
            np.maximum(times, time, out=times)
        for side, (normal, excess) in enumerate(self.lanes):
            _cross(lane[side], worst, rollouts.x, rollouts.y, normal, excess, rollouts.step)
        cone = np.zeros((num, self.num_columns))
        cone[:, self.columns] = times.T
        return Risk(cone, np.ascontiguousarray(lane.T), worst)
