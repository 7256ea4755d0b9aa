"""What every behaviour of people has in common."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from mjnav.geometry.kernel_types import Flags, Indices
from mjnav.messages import Array, WorldState
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Scenario

ARRIVAL_TIME = 0.8  # [s] in which the distance to the last waypoint falls to 1/e
NEARLY = 1.0 + 1e-9  # of squares of distances: who is left out by it is too far by any rounding


class Walk(ABC):
    """How the n people walk who have one behaviour, and who all see the robot or all do not.

    Made as Class(scenario, index, seed): `index` (n,) are their places in `scenario.people` and in the arrays of a
    WorldState; random draws come from `mjnav.rng.stream(seed, "behaviour.NAME", "personI")` alone. It is asked every
    PERIOD of simulated time, never at the control rate, and keeps its own state, such as the next waypoint.
    """

    tempers: ClassVar[bool] = False  # whether the walk asks the people's temperaments itself
    sidesteps = True  # whether its people go round whom they touch (`sidestep`)

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        self.index = index

    @abstractmethod
    def velocities(self, world: WorldState) -> Array:
        """(n, 2) [m/s], from the true state of the robot and of all P people.

        For people who do not see the robot its pose and twist are NaN. Positions of people who are not there are NaN,
        and what is returned for them is not used.
        """

    def arrived(self, world: WorldState) -> Flags:
        """(n,) whose way is over, so that they leave the scene; nobody's unless the behaviour says so."""
        return np.zeros(len(self.index), bool)

    def begin(self, place: int, start: Point, goal: Point) -> None:
        """The person at `place` of `index` comes again at `start` and walks to `goal`; for who has trips."""
        raise NotImplementedError(f"{type(self).__name__} has no trips")
