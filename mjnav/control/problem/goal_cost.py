"""The cost of leaving the way to the goal, at the mean state.

    J(u) = |x'(u) - x'_d|^2 + w_h (wrap(theta + omega tau - theta_goal) / pi)^2
         + w_v (dv / dv_max)^2 + w_omega (domega / domega_max)^2

x'(u) = v [cos(theta + omega tau), sin(...)]; x'_d points to the goal at the preferred speed and slows near it; dv and
domega are the change of control, dv_max and domega_max the most that one period allows. The first term and the last
two are the cost of Nair et al.; the heading's makes a robot at rest turn to a goal behind it.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from mjnav.compile.compiled import Matrix, exact
from mjnav.control.parameters import GoalParameters
from mjnav.control.problem.candidates import Candidates
from mjnav.control.rollouts import Rollouts
from mjnav.messages import Array, RobotLimits

TINY = 1e-300  # [m], so that the way to a goal that is reached has a length


def _cost_of(vx, vy, heading, change, wanted_x, wanted_y, bearing, heading_weight):
    """J of numbers, or of arrays that broadcast."""
    ex, ey = vx - wanted_x, vy - wanted_y
    turns = (heading - bearing) / (2.0 * pi)
    half_turns = 2.0 * (turns - np.floor(turns + 0.5))  # of the wrapped difference
    return ex * ex + ey * ey + heading_weight * half_turns * half_turns + change


_cost_at = exact(_cost_of)


@exact
def _costs_along(
    v: Matrix,
    omega: Matrix,
    heading: Matrix,
    cos: Matrix,
    sin: Matrix,
    dx: Matrix,
    dy: Matrix,
    bearing: Matrix,
    before: tuple[float, float],
    first: tuple[float, float],
    change: tuple[float, float],
    change_weight: tuple[float, float],
    speed: float,
    approach_time: float,
    heading_weight: float,
):
    """The mean of J over the steps of K paths, (K,); every array is (T, K), the goal is (dx, dy) from each state.

    `before` is the control before the first step; `first` and `change` are the most that the first and each later
    control may change.
    """
    num_steps, num = v.shape
    cost = np.zeros(num)
    for t in range(num_steps):
        most_v, most_omega = first if t == 0 else change
        for k in range(num):
            distance = np.sqrt(dx[t, k] * dx[t, k] + dy[t, k] * dy[t, k])
            dv = (v[t, k] - (before[0] if t == 0 else v[t - 1, k])) / most_v
            domega = (omega[t, k] - (before[1] if t == 0 else omega[t - 1, k])) / most_omega
            changed = change_weight[0] * dv * dv + change_weight[1] * domega * domega
            per_metre = min(speed, distance / approach_time) / max(distance, TINY)
            vx, vy = v[t, k] * cos[t, k], v[t, k] * sin[t, k]
            wanted_x, wanted_y = per_metre * dx[t, k], per_metre * dy[t, k]
            cost[k] += _cost_at(vx, vy, heading[t, k], changed, wanted_x, wanted_y, bearing[t, k], heading_weight)
    return cost / num_steps


def mean_goal_cost(
    rollouts: Rollouts, dx: Array, dy: Array, twist: Array, limits: RobotLimits, period: float, p: GoalParameters
) -> Array:
    """J of the states at the ends of all steps, on average, for each of K rollouts, (K,).

    From each state the goal is (dx, dy) away, (T, K) each [m]; `twist` (2,) is the command decided last. The first
    control is reached in one `period`, each of the others in one step.
    """
    r, (v, omega) = rollouts, twist.tolist()
    return _costs_along(
        *r.controls, r.heading, *r.direction, dx, dy, np.arctan2(dy, dx), (v, omega),
        (limits.max_acceleration * period, limits.max_turn_acceleration * period),
        (limits.max_acceleration * r.step, limits.max_turn_acceleration * r.step),
        (p.speed_change_weight, p.turn_change_weight),
        min(p.preferred_speed, limits.max_speed), p.approach_time, p.heading_weight,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class GoalCost:
    """J of every candidate as a function of the mean position: what does not depend on it is computed once."""

    heading: Array  # (K,) theta + omega tau
    vx: Array  # (K,) x'(u)
    vy: Array  # (K,)
    change: Array  # (K,) the two terms of the change of control
    speed: float  # [m/s] of x'_d far from the goal
    approach_time: float  # [s]
    heading_weight: float

    @classmethod
    def of(
        cls,
        candidates: Candidates,
        heading: float,
        twist: Array,
        limits: RobotLimits,
        period: float,
        parameters: GoalParameters,
    ) -> "GoalCost":
        """For a mean heading and the command decided last, `twist` (2,)."""
        p = parameters
        c, (v, omega) = candidates, twist.tolist()
        after = heading + c.omega * p.preview
        v_weight = p.speed_change_weight / (limits.max_acceleration * period) ** 2
        turn_weight = p.turn_change_weight / (limits.max_turn_acceleration * period) ** 2
        return cls(
            heading=after,
            vx=c.v * np.cos(after),
            vy=c.v * np.sin(after),
            change=v_weight * (c.v - v) ** 2 + turn_weight * (c.omega - omega) ** 2,
            speed=min(p.preferred_speed, limits.max_speed),
            approach_time=p.approach_time,
            heading_weight=p.heading_weight,
        )

    def __call__(self, position: Array, goal: Array) -> Array:
        """J, (K,), at a mean position (2,) on the way to `goal` (2,); positions (2, ...) broadcast with the terms."""
        dx, dy = goal[0] - position[0], goal[1] - position[1]
        distance = np.hypot(dx, dy)
        speed = np.minimum(self.speed, distance / self.approach_time)
        per_metre = speed / np.maximum(distance, TINY)
        wanted_x, wanted_y, bearing = per_metre * dx, per_metre * dy, np.arctan2(dy, dx)
        return _cost_of(
            self.vx, self.vy, self.heading, self.change, wanted_x, wanted_y, bearing, self.heading_weight
        )  # fmt: skip
