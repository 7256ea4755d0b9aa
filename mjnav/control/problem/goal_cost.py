"""The cost of leaving the way to the goal, at the mean state.

    J(u) = |x'(u) - x'_d|^2 + w_h (wrap(theta + omega tau - theta_goal) / pi)^2
         + w_v (dv / dv_max)^2 + w_omega (domega / domega_max)^2

x'(u) = v [cos(theta + omega tau), sin(...)]; x'_d points to the goal at the preferred speed and slows near it; dv and
domega are the change of control, dv_max and domega_max the most that one period allows. The first term and the last
two are the cost of Nair et al.; the heading's makes a robot at rest turn to a goal behind it.
"""

from dataclasses import dataclass
from math import floor, pi

import numpy as np

from mjnav.control.parameters import GoalParameters
from mjnav.control.problem.candidates import Candidates
from mjnav.geometry.compiled import elementwise
from mjnav.messages import Array, RobotLimits

TINY = 1e-300  # [m], so that the way to a goal that is reached has a length


@elementwise
def _change(v: float, omega: float, v_before: float, omega_before: float, v_weight: float, omega_weight: float):
    return v_weight * (v - v_before) ** 2 + omega_weight * (omega - omega_before) ** 2


@elementwise
def _cost(
    vx: float,
    vy: float,
    heading: float,
    change: float,
    wanted_x: float,
    wanted_y: float,
    bearing: float,
    heading_weight: float,
):
    ex, ey = vx - wanted_x, vy - wanted_y
    turns = (heading - bearing) / (2.0 * pi)
    half_turns = 2.0 * (turns - floor(turns + 0.5))  # of the wrapped difference
    return ex * ex + ey * ey + heading_weight * half_turns * half_turns + change


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
        after = heading + candidates.omega * p.preview
        dv, domega = limits.max_acceleration * period, limits.max_turn_acceleration * period
        return cls(
            heading=after,
            vx=candidates.v * np.cos(after),
            vy=candidates.v * np.sin(after),
            change=_change(
                candidates.v, candidates.omega, *twist, p.speed_change_weight / dv**2, p.turn_change_weight / domega**2
            ),
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
        return _cost(
            self.vx, self.vy, self.heading, self.change, wanted_x, wanted_y, bearing, self.heading_weight
        )  # fmt: skip
