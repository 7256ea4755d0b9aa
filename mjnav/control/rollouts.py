"""Rollouts: sequences of (v, omega) within the robot's limits and the paths along exact arcs that they lead along.

Arrays are (T, K), step by rollout, so that the innermost loops run over the rollouts. Positions are relative to the
robot's at the start, a planner's to the mean one; step t ends (t + 1) `step` seconds after the start.
"""

from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from mjnav.compile.compiled import Matrix, kernel
from mjnav.messages import Array, RobotLimits
from mjnav.motion.unicycle import arc_onward, control_bounds, reachable


@kernel
def _limit(out: Matrix, first_low: float, first_high: float, low: float, high: float, change: float):
    """Clips controls (T, K) to [low, high], each to at most `change` from the one before, the first to its window."""
    for k in range(out.shape[1]):
        out[0, k] = min(max(out[0, k], first_low), first_high)
    for t in range(1, out.shape[0]):
        for k in range(out.shape[1]):
            before = out[t - 1, k]
            out[t, k] = min(max(out[t, k], max(low, before - change)), min(high, before + change))


@kernel
def _drive(
    x: Matrix, y: Matrix, heading: Matrix, c: Matrix, s: Matrix, v: Matrix, omega: Matrix, start: float, step: float
):
    """The exact arcs from the origin at heading `start`, under controls v and omega; every array is (T, K)."""
    cos, sin = np.cos(start), np.sin(start)
    for t in range(v.shape[0]):
        for k in range(v.shape[1]):
            at = (x[t - 1, k], y[t - 1, k], c[t - 1, k], s[t - 1, k]) if t > 0 else (0.0, 0.0, cos, sin)
            half = 0.5 * step * omega[t, k]
            x[t, k], y[t, k], c[t, k], s[t, k] = arc_onward(*at, half, step * v[t, k])
            heading[t, k] = (heading[t - 1, k] if t > 0 else start) + 2.0 * half


@kernel
def _between(out: Matrix, ends: Matrix, first: float):
    """Coordinates at the ends of equal parts of steps, (parts T, K), from `first` and those at steps' ends (T, K)."""
    parts = out.shape[0] // ends.shape[0]
    for t in range(ends.shape[0]):
        for i in range(parts):
            share = (i + 1) / parts
            row, end, start = out[t * parts + i], ends[t], ends[max(t - 1, 0)]
            for k in range(row.size):
                row[k] = (1.0 - share) * (start[k] if t > 0 else first) + share * end[k]


FARTHEST = 0.25  # [m] between positions that are looked at: else a fast robot plans through pillars between two steps


def parts_of(limits: RobotLimits, step: float) -> int:
    """Into how many parts steps of `step` [s] are cut, so that the robot goes FARTHEST in each at most."""
    return max(ceil(step * max(limits.max_speed, -limits.min_speed) / FARTHEST - 1e-9), 1)


@dataclass(frozen=True, slots=True)
class ControlLimits:
    """Limits of the controls (v, omega) of a plan."""

    first: Array  # (2, 2) lowest and highest of the first
    all: Array  # (2, 2) of all others
    change: Array  # (2,) the most from one to the next

    @classmethod
    def of(cls, twist: Array, limits: RobotLimits, period: float, step: float) -> "ControlLimits":
        """The first control is reached from `twist` (2,) in one `period`, each later one in one `step`."""
        change = np.array([limits.max_acceleration, limits.max_turn_acceleration]) * step
        return cls(np.array(reachable(twist, limits, period)), np.array(control_bounds(limits)), change)


@dataclass(frozen=True, slots=True)
class Rollouts:
    """K control sequences and the path of each from the mean state."""

    controls: Array  # (2, T, K) v [m/s], omega [rad/s]
    x: Array  # (T, K) [m], at the end of each step
    y: Array  # (T, K)
    heading: Array  # (T, K) [rad]
    direction: Array  # (2, T, K) its cosine and sine
    step: float  # [s]
    start: tuple[float, float] = (0.0, 0.0)  # [m] of the paths, from the mean position

    @classmethod
    def of(cls, wanted: Array, heading: float, limits: ControlLimits, step: float) -> "Rollouts":
        """From wanted controls (2, T, K), brought within the limits."""
        controls = np.array(wanted, order="C")
        _, num_steps, num = controls.shape
        first, bounds = limits.first, limits.all
        for c in range(2):
            _limit(controls[c], first[0, c], first[1, c], bounds[0, c], bounds[1, c], limits.change[c])
        x, y, headings, cos, sin = path = np.empty((5, num_steps, num))
        _drive(x, y, headings, cos, sin, controls[0], controls[1], float(heading), step)
        return cls(controls, x, y, headings, path[3:], step)

    def of_disc(self, ahead: float, heading: float) -> "Rollouts":
        """The paths of a point `ahead` [m] of the centre; the robot's `heading` is that at the start."""
        if ahead == 0.0:
            return self
        start = ahead * float(np.cos(heading)), ahead * float(np.sin(heading))
        x, y = self.x + ahead * self.direction[0], self.y + ahead * self.direction[1]
        return replace(self, x=x, y=y, start=start)

    def between(self, parts: int) -> tuple[Array, Array]:
        """x and y (parts T, K) at the ends of so many equal parts of each step, straight on from end to end."""
        if parts == 1:
            return self.x, self.y
        x, y = np.empty((2, parts * len(self.x), self.x.shape[1]))
        _between(x, self.x, self.start[0])
        _between(y, self.y, self.start[1])
        return x, y

    def only(self, kept: list[int] | NDArray[np.int64]) -> "Rollouts":
        """These rollouts alone, by their numbers."""
        paths = (self.controls, self.x, self.y, self.heading, self.direction)
        controls, x, y, heading, direction = (np.ascontiguousarray(a[..., kept]) for a in paths)
        return Rollouts(controls, x, y, heading, direction, self.step, self.start)
