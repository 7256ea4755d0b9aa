"""A person who walks straight on, and stands still now and then."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.messages import WorldState
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle

PERIOD = 0.02  # [s] at which a behaviour is asked


@dataclass(frozen=True, slots=True, kw_only=True)
class HesitantParameters:
    """Keys beside the behaviour's name."""

    speed: Annotated[float, Range(0.0, 2.0, "m/s")] = 0.8
    heading: Annotated[float, Range(-180.0, 180.0, "°")] = 0.0
    walking: Annotated[float, Range(0.1, 100.0, "s"), "mean time until the next stop"] = 3.0
    standing: Annotated[float, Range(0.1, 100.0, "s"), "mean time of a stop"] = 1.0

    def __post_init__(self):
        settle(self)


class Hesitant:
    """Walking and standing last for exponentially distributed times."""

    parameters_type = HesitantParameters

    def __init__(self, scenario: Scenario, person: int, rng: np.random.Generator, parameters: HesitantParameters):
        self._rng, self._parameters, self._walks = rng, parameters, True

    def velocity(self, world: WorldState) -> tuple[float, float]:
        """The desired velocity [m/s]."""
        p = self._parameters
        if self._rng.random() < PERIOD / (p.walking if self._walks else p.standing):
            self._walks = not self._walks
        speed, heading = p.speed * self._walks, np.deg2rad(p.heading)
        return speed * np.cos(heading), speed * np.sin(heading)
