"""Rollouts: control sequences within the robot's limits and the paths they lead along.

Arrays are (T, K), step by rollout, so that the innermost loops run over the rollouts. Positions are relative to the
robot's mean position; step t ends (t + 1) `step` seconds after the decision takes effect.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.control.parameters import GoalParameters
from mjnav.geometry.angles import shortest_turn
from mjnav.geometry.compiled import Matrix, Vector, kernel, scalar
from mjnav.messages import Array, RobotLimits
from mjnav.motion.unicycle import control_bounds, reachable

turn_by = scalar(shortest_turn)


@scalar
def chord(v, half_turn, step):
    """Length of the chord of an arc that turns by twice `half_turn`."""
    return step * v * (np.sin(half_turn) / half_turn if half_turn != 0.0 else 1.0)


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
def _drive(heading: Matrix, x: Matrix, y: Matrix, v: Matrix, omega: Matrix, step: float):
    """The exact arcs from the origin at heading[0]; every array (T + 1, K) but the controls (T, K)."""
    for t in range(v.shape[0]):
        for k in range(v.shape[1]):
            half = 0.5 * step * omega[t, k]
            length = chord(v[t, k], half, step)
            x[t + 1, k] = x[t, k] + length * np.cos(heading[t, k] + half)
            y[t + 1, k] = y[t, k] + length * np.sin(heading[t, k] + half)
            heading[t + 1, k] = heading[t, k] + 2.0 * half


@kernel
def _approach(
    out: Matrix,
    heading: float,
    goal_x: float,
    goal_y: float,
    first: Matrix,
    bounds: Matrix,
    change: Vector,
    speed: float,
    approach_time: float,
    preview: float,
    step: float,
):
    """Controls (2, T) that turn to the goal and drive there, from the origin at `heading`.

    first and bounds (2, 2): lowest and highest (v, omega), of the first control and of all; `change` (2,) is the most
    from one to the next.
    """
    x, y = 0.0, 0.0
    for t in range(out.shape[1]):
        dx, dy = goal_x - x, goal_y - y
        distance = np.sqrt(dx * dx + dy * dy)
        turn = turn_by(np.arctan2(dy, dx) - heading) if distance > 0.0 else 0.0
        out[0, t] = min(speed, distance / approach_time) * max(np.cos(turn), 0.0)
        out[1, t] = turn / preview
        for c in range(2):
            low, high = first[0, c], first[1, c]
            if t > 0:
                before = out[c, t - 1]
                low, high = max(bounds[0, c], before - change[c]), min(bounds[1, c], before + change[c])
            out[c, t] = min(max(out[c, t], low), high)
        half = 0.5 * step * out[1, t]
        length = chord(out[0, t], half, step)
        x += length * np.cos(heading + half)
        y += length * np.sin(heading + half)
        heading += 2.0 * half


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
        return cls(np.stack(reachable(twist, limits, period)), np.stack(control_bounds(limits)), change)


@dataclass(frozen=True, slots=True)
class Rollouts:
    """K control sequences and the path of each from the mean state."""

    controls: Array  # (2, T, K) v [m/s], omega [rad/s]
    x: Array  # (T, K) [m], at the end of each step
    y: Array  # (T, K)
    heading: Array  # (T, K) [rad]
    step: float  # [s]

    @classmethod
    def of(cls, wanted: Array, heading: float, limits: ControlLimits, step: float) -> "Rollouts":
        """From wanted controls (2, T, K), brought within the limits."""
        controls = np.array(wanted, order="C")
        _, num_steps, num = controls.shape
        first, bounds = limits.first, limits.all
        for c in range(2):
            _limit(controls[c], first[0, c], first[1, c], bounds[0, c], bounds[1, c], limits.change[c])
        x, y, headings = np.zeros((3, num_steps + 1, num))
        headings[0] = heading
        _drive(headings, x, y, controls[0], controls[1], step)
        return cls(controls, x[1:], y[1:], headings[1:], step)

    def first(self, steps: int) -> "Rollouts":
        """The same without what comes after `steps`."""
        return Rollouts(self.controls[:, :steps], self.x[:steps], self.y[:steps], self.heading[:steps], self.step)

    def only(self, k: int) -> "Rollouts":
        """Rollout k alone."""
        return Rollouts(self.controls[:, :, [k]], self.x[:, [k]], self.y[:, [k]], self.heading[:, [k]], self.step)

    @property
    def v(self) -> Array:
        """(T, K) [m/s]."""
        return self.controls[0]

    @property
    def omega(self) -> Array:
        """(T, K) [rad/s]."""
        return self.controls[1]


def approach(
    goal: Array, heading: float, limits: ControlLimits, speed: float, step: float, num: int, parameters: GoalParameters
) -> Array:
    """`num` controls (2, T) within the limits, straight to `goal` (2,), which is relative to the robot.

    The robot turns to the goal within the preview, and drives as fast as the goal cost wants it to, `speed` [m/s] far
    from the goal, slower while it faces another way.
    """
    out = np.empty((2, num))
    _approach(
        out, heading, goal[0], goal[1], limits.first, limits.all, limits.change, speed, parameters.approach_time,
        parameters.preview, step,
    )  # fmt: skip
    return out
