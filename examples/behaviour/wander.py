"""A behaviour of people: they wander, and step aside for a robot that comes close.

    mjnav run wander.toml

The desired heading does a random walk; within `shyness` metres of the robot the person walks straight away from it.
People are part of the world, so a behaviour sees its true state, the robot's true place among it. For a person with
`sees_robot = false` the robot's pose is NaN, which is near nobody: such a person does not step aside.
"""

from dataclasses import dataclass
from math import atan2, cos, hypot, sin, sqrt
from typing import Annotated

import numpy as np

from mjnav.messages import WorldState
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle

PERIOD = 0.02  # [s] at which a behaviour is asked


@dataclass(frozen=True, slots=True, kw_only=True)
class WanderParameters:
    """Keys beside the behaviour's name."""

    speed: Annotated[float, Range(0.0, 2.0, "m/s")] = 0.6
    turning: Annotated[float, Range(0.0, 10.0, "rad/√s"), "spread of the heading after one second"] = 0.8
    shyness: Annotated[float, Range(0.0, 5.0, "m"), "of the robot"] = 1.2

    def __post_init__(self):
        settle(self)


class Wander:
    """One person; everyone who has this behaviour gets an object and a generator of their own."""

    parameters_type = WanderParameters

    def __init__(self, scenario: Scenario, person: int, rng: np.random.Generator, parameters: WanderParameters):
        self._person, self._rng, self._parameters = person, rng, parameters
        self._heading = rng.uniform(-np.pi, np.pi)

    def velocity(self, world: WorldState) -> tuple[float, float]:
        """The desired velocity [m/s]. One draw a call, whatever there is to see, keeps seeds comparable."""
        p = self._parameters
        self._heading += p.turning * sqrt(PERIOD) * self._rng.standard_normal()
        dx, dy = world.people_position[self._person] - world.robot_pose[:2]
        if hypot(dx, dy) < p.shyness:
            self._heading = atan2(dy, dx)
        return p.speed * cos(self._heading), p.speed * sin(self._heading)
