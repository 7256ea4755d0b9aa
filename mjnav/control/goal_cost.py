"""The cost of leaving the way to the goal, at the mean state.

    J(u) = |x'(u) - x'_d|^2 + w_h (wrap(theta + omega tau - theta_goal) / pi)^2
         + w_v (dv / dv_max)^2 + w_omega (domega / domega_max)^2

x'(u) = v [cos(theta + omega tau), sin(...)]; x'_d points to the goal at the preferred speed and slows near it; dv and
domega are the change of control, dv_max and domega_max the most that one period allows. The first term and the last
two are the cost of Nair et al.; the heading's makes a robot at rest turn to a goal behind it.
"""

import numpy as np

from mjnav.control.candidates import Candidates
from mjnav.control.parameters import Parameters
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, RobotLimits


def goal_cost(
    candidates: Candidates,
    pose: Array,
    goal: Array,
    twist: Array,
    limits: RobotLimits,
    period: float,
    parameters: Parameters,
) -> Array:
    """J of every candidate, (K,), for the mean pose (3,)."""
    p = parameters
    dx, dy = goal[0] - pose[0], goal[1] - pose[1]
    distance = float(np.hypot(dx, dy))
    speed = min(p.preferred_speed, limits.max_speed, distance / p.approach_time)
    direction = (dx / distance, dy / distance) if distance > 0.0 else (0.0, 0.0)
    heading = pose[2] + candidates.omega * p.preview
    ex = candidates.v * np.cos(heading) - speed * direction[0]
    ey = candidates.v * np.sin(heading) - speed * direction[1]
    cost = ex * ex + ey * ey
    cost += p.heading_weight * (wrap(heading - np.arctan2(dy, dx)) / np.pi) ** 2
    cost += p.speed_change_weight * ((candidates.v - twist[0]) / (limits.max_acceleration * period)) ** 2
    return cost + p.turn_change_weight * ((candidates.omega - twist[1]) / (limits.max_turn_acceleration * period)) ** 2
