"""Obstacles as the methods take them: predicted futures, and the discs and walls that count in a decision.

A method that looks at one moment of decision alone moves every obstacle along a straight line. Of a sample m with a
predicted future x_m(t) it takes the velocity that leads to where the sample is predicted after the method's horizon,

    o'_m = (x_m(T) - x_m(0)) / T,     T the horizon, or the prediction's end where that is sooner.

So the straight line is right at its two ends. A method that plans in time takes x_m(t) itself, linear between the
predicted positions; after the last of them every sample keeps its last velocity.

The discs and walls that count are laid out for the kernel, `control/kernels/cone_kernel.py`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from mjnav.compile.compiled import Cube, Indices, ReadOnlyCube, ReadOnlyMatrix, Vector, exact, kernel
from mjnav.constraints.walls import point_to_segment
from mjnav.control.kernels.cone_kernel import ConeBlocks
from mjnav.control.parameters import Parameters
from mjnav.messages import Array, Observation, ObstacleSamples, RobotLimits


def straightened(obstacle: ObstacleSamples, horizon: float) -> ObstacleSamples:
    """The obstacle with the velocities that lead to its future at `horizon` [s]; without a future as it is."""
    if obstacle.future is None:
        return obstacle
    end = min(horizon, obstacle.step * obstacle.future.shape[1])
    (there,) = positions_at(obstacle, np.array([end]))
    return replace(obstacle, velocity=(there - obstacle.position) / end, future=None, step=0.0)


def positions_at(obstacle: ObstacleSamples, times: Array) -> Array:
    """Where the samples of an obstacle are at `times` (T,) [s] after the moment of effect: (T, M, 2) [m]."""
    if obstacle.future is None:
        return obstacle.position + times[:, None, None] * obstacle.velocity
    out = np.empty((len(times), *obstacle.position.shape))
    _follow(out, *map(np.ascontiguousarray, (obstacle.position, obstacle.future)), times / obstacle.step)
    return out


@exact
def _follow(out: Cube, position: ReadOnlyMatrix, future: ReadOnlyCube, steps: Vector):
    """Along `future` (M, H, 2) from `position` (M, 2), after so many `steps` (T,): (T, M, 2)."""
    last = future.shape[1] - 1
    for t in range(steps.size):
        before = min(max(int(steps[t]), 0), last)
        share = steps[t] - before  # above 1 beyond the last position
        for m in range(position.shape[0]):
            for c in range(2):
                start = position[m, c] if before == 0 else future[m, before - 1, c]
                out[t, m, c] = start + share * (future[m, before, c] - start)


@dataclass(frozen=True, slots=True)
class Discs:
    """The samples of J discs one after another, and each disc's mean."""

    position: Array  # (S, 2) samples; disc j has rows start[j] ... start[j + 1] - 1
    velocity: Array  # (S, 2)
    start: np.ndarray  # (J + 1,) int
    radius: Array  # (J,)

    @classmethod
    def of(cls, obstacles: Sequence[ObstacleSamples]) -> "Discs":
        """From an observation's obstacles."""
        if not obstacles:
            return cls(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(1, np.int64), np.zeros(0))
        return cls(
            np.concatenate([o.position for o in obstacles]),
            np.concatenate([o.velocity for o in obstacles]),
            np.array([*accumulate((len(o.position) for o in obstacles), initial=0)]),
            np.array([o.radius for o in obstacles]),
        )

    @property
    def sizes(self) -> NDArray[np.int64]:
        """How many samples each disc has, (J,)."""
        return self.start[1:] - self.start[:-1]

    def take(self, indices: Sequence[int]) -> "Discs":
        """The discs of these indices, in their order."""
        chosen = np.array(indices, np.int64)
        rows, start = _rows_of(self.start, chosen)
        return Discs(self.position[rows], self.velocity[rows], start, self.radius[chosen])

    def means(self) -> "Discs":
        """The same discs with one sample each: the mean."""
        if not len(self.radius):
            return self
        count, first = self.sizes[:, None], self.start[:-1]
        return Discs(
            np.add.reduceat(self.position, first) / count,
            np.add.reduceat(self.velocity, first) / count,
            np.arange(len(self.radius) + 1),
            self.radius,
        )

    def variances(self) -> Array:
        """Of each disc's position by x and y, (J, 2) [m^2]."""
        count, first = self.sizes, self.start[:-1]
        if not len(count):
            return np.zeros((0, 2))
        departure = self.position - np.repeat(self.means().position, count, axis=0)
        return np.add.reduceat(departure * departure, first) / count[:, None]


@exact
def _rows_of(start: Indices, chosen: Indices):
    """The rows of the chosen blocks, one block after another, and where each begins among them, (B + 1,)."""
    begin = np.zeros(len(chosen) + 1, np.int64)
    for b in range(len(chosen)):
        begin[b + 1] = begin[b] + start[chosen[b] + 1] - start[chosen[b]]
    rows = np.empty(begin[-1], np.int64)
    for b in range(len(chosen)):
        for i in range(begin[b + 1] - begin[b]):
            rows[begin[b] + i] = start[chosen[b]] + i
    return rows, begin


@dataclass(frozen=True, slots=True)
class Reach:
    """Indices of the discs that count, nearest first, and of the walls; each in its own list of the observation."""

    discs: tuple[int, ...]
    walls: tuple[int, ...]


def discs_in_reach(means: Discs, mean_pose: Array, limits: RobotLimits, parameters: Parameters) -> tuple[int, ...]:
    """The discs within sensing_range of the mean pose, at most max_obstacles, nearest first."""
    gaps = np.hypot(*(means.position - mean_pose[:2]).T) - means.radius
    order = np.argsort(gaps, kind="stable")
    return tuple(order[gaps[order] <= parameters.reach(limits.max_speed)][: parameters.max_obstacles].tolist())


def walls_in_reach(observation: Observation, limits: RobotLimits, parameters: Parameters) -> tuple[int, ...]:
    """The walls that could matter.

    A wall farther off than the path of wall_horizon at top speed, plus the distance at which the clip cuts f off, gives
    the same samples for every candidate: it is left out.
    """
    p = parameters
    if not len(observation.walls):
        return ()
    distance = _wall_distance(observation.robot_pose, observation.walls)
    radius = limits.radius + p.safety_margin
    cut = radius * np.sqrt(1.0 + p.clip) if p.normalise else np.sqrt(radius**2 + p.clip)
    fastest = max(limits.max_speed, -limits.min_speed) + np.abs(observation.control_noise[:, 0]).max()
    reach = min(p.reach(limits.max_speed), fastest * p.wall_horizon + cut)
    return tuple(np.flatnonzero(distance <= reach).tolist())


@kernel
def _wall_distance(pose: ReadOnlyMatrix, walls: ReadOnlyCube):
    """Least distance of any of the robot's samples (N, 3) from each wall (W, 2, 2): (W,)."""
    out = np.empty(len(walls))
    for w in range(len(walls)):
        ax, ay = walls[w, 0, 0], walls[w, 0, 1]
        dx, dy = walls[w, 1, 0] - ax, walls[w, 1, 1] - ay
        least = np.inf
        for i in range(len(pose)):
            least = min(least, point_to_segment(pose[i, 0], pose[i, 1], ax, ay, dx, dy))
        out[w] = np.sqrt(least)
    return out


def blocks(
    discs: Discs, reach: Reach, observation: Observation, limits: RobotLimits, parameters: Parameters
) -> ConeBlocks:
    """What is in reach as the kernel takes it; `discs` are those in reach, in their order."""
    num_discs, num_walls = len(reach.discs), len(reach.walls)
    radius = np.full(num_discs + num_walls, limits.radius + parameters.safety_margin)
    radius[:num_discs] += discs.radius
    radius_squared = radius * radius
    wall = np.zeros((num_discs + num_walls, 4))
    wall[num_discs:] = observation.walls[list(reach.walls)].reshape(-1, 4)
    return ConeBlocks(
        column=np.array([*reach.discs, *(len(observation.obstacles) + w for w in reach.walls)], dtype=np.int64),
        start=np.concatenate([discs.start, discs.start[-1] + np.arange(1, num_walls + 1)]),
        num_discs=num_discs,
        position=discs.position,
        velocity=discs.velocity,
        radius_squared=radius_squared,
        unit=1.0 / radius_squared if parameters.normalise else np.ones_like(radius_squared),
        wall=wall,
    )
