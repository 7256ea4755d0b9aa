"""A metric: how long the robot is in somebody's personal space, and how fast it drives where it is closest to them.

    mjnav run crossing1 --set 'metrics=["personal_space.py:PersonalSpace"]'

The figures stand in the summary under `metrics`, in the rows of a sweep, and in `mjnav compare` and `--require` with
`metrics_` in front of their names. A metric gets a whole run as arrays, which it cannot change.
"""

from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

import numpy as np

from mjnav.messages import Trajectory
from mjnav.metrics import Figure
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle


@dataclass(frozen=True, slots=True, kw_only=True)
class PersonalSpaceParameters:
    """Keys beside the metric's name."""

    distance: Annotated[float, Range(0.0, 10.0, "m"), "between the surfaces"] = 1.2  # Hall, The Hidden Dimension (1966)

    def __post_init__(self):
        settle(self)


class PersonalSpace:
    """Distances are between surfaces, at the ticks."""

    parameters_type = PersonalSpaceParameters
    figures = MappingProxyType(
        {
            "personal_space_s": Figure("s", "Time within the personal space of at least one person."),
            "closest_speed_m_s": Figure(
                "m/s", "Speed of the robot when it is closest to a person; null without people."
            ),
        }
    )

    def __init__(self, parameters: PersonalSpaceParameters):
        self._distance = parameters.distance

    def measure(self, trajectory: Trajectory, scenario: Scenario) -> dict[str, float | None]:
        """A value for each of `figures`."""
        if not scenario.people:
            return {"personal_space_s": 0.0, "closest_speed_m_s": None}
        radii = np.array([person.radius for person in scenario.people]) + scenario.robot.radius
        apart = trajectory.people_position - trajectory.robot_pose[:, None, :2]  # (T + 1, P, 2)
        nearest = (np.hypot(apart[..., 0], apart[..., 1]) - radii).min(axis=1)
        inside = nearest[:-1] < self._distance
        return {
            "personal_space_s": float(inside @ np.diff(trajectory.time)),
            "closest_speed_m_s": float(abs(trajectory.robot_twist[nearest.argmin(), 0])),
        }
