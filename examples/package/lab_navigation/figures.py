"""A metric: how long the robot stands."""

from types import MappingProxyType

import numpy as np

from mjnav.messages import Trajectory
from mjnav.metrics import Figure
from mjnav.scene.spec import Scenario

STANDS_BELOW = 0.02  # [m/s]


class Standing:
    """By the robot's true speed at the ticks."""

    figures = MappingProxyType({"standing_s": Figure("s", "Time in which the robot drives at less than 0.02 m/s.")})

    def measure(self, trajectory: Trajectory, scenario: Scenario) -> dict[str, float]:
        """A value for each of `figures`."""
        stands = np.abs(trajectory.robot_twist[:-1, 0]) < STANDS_BELOW
        return {"standing_s": float(stands @ np.diff(trajectory.time))}
