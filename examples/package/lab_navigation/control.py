"""A controller that drives straight to the goal, and stops while a person may be near."""

from math import atan2, remainder, tau

import numpy as np

from mjnav.control.parameters import LoopParameters
from mjnav.messages import Decision, Observation, RobotLimits, Status

STOP_WITHIN = 1.5  # [m] of the nearest sample of any person


class Careful:
    """Looks at positions alone, whatever the velocities."""

    def __init__(self, robot_limits: RobotLimits, period: float, parameters: LoopParameters):
        self._speed, self._max_turn_rate = parameters.preferred_speed, robot_limits.max_turn_rate

    def decide(self, observation: Observation) -> Decision:
        """The control for the moment at which the observation's samples stand."""
        x, y = observation.robot_pose[:, :2].mean(axis=0)
        headings = observation.robot_pose[:, 2]
        heading = atan2(np.sin(headings).mean(), np.cos(headings).mean())
        error = remainder(atan2(observation.goal[1] - y, observation.goal[0] - x) - heading, tau)
        nearest = min((np.hypot(*(o.position - (x, y)).T).min() for o in observation.obstacles), default=np.inf)
        speed = self._speed if nearest > STOP_WITHIN and abs(error) < 0.5 else 0.0
        return Decision(speed, float(np.clip(error, -self._max_turn_rate, self._max_turn_rate)), Status.OK)
