"""A tracker: an alpha-beta filter a person, the simplest that estimates a velocity.

    mjnav run crossing1 --set estimation.obstacles.tracker=alpha_beta.py:AlphaBeta

With the residual r = z - (x + v T) of a detection z after T seconds,

    x <- x + v T + alpha r,    v <- v + beta r / T    (Bar-Shalom, Li & Kirubarajan 2001, section 6.5)

The controller takes samples: they are drawn from a Gaussian about the estimate.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.messages import Reading, Track
from mjnav.rng import stream
from mjnav.robot.estimation.base import person_names, person_track
from mjnav.scene.spec import Scenario
from mjnav.settings import Range, settle


@dataclass(frozen=True, slots=True, kw_only=True)
class AlphaBetaParameters:
    """Keys beside the tracker's name."""

    alpha: Annotated[float, Range(0.01, 1.0), "gain of the position"] = 0.4
    beta: Annotated[float, Range(0.001, 1.0), "gain of the velocity"] = 0.1
    position_std: Annotated[float, Range(0.001, 1.0, "m"), "of the samples"] = 0.08
    velocity_std: Annotated[float, Range(0.001, 2.0, "m/s"), "of the samples"] = 0.2

    def __post_init__(self):
        settle(self)


class AlphaBeta:
    """One filter a person; detections come with their person."""

    parameters_type = AlphaBetaParameters

    def __init__(self, scenario: Scenario, seed: int, parameters: AlphaBetaParameters):
        p = self._parameters = parameters
        self._names = person_names(len(scenario.people))
        self._radii = [person.radius for person in scenario.people]
        num = scenario.estimation.obstacles.particles
        spread = [p.position_std, p.position_std, p.velocity_std, p.velocity_std]
        # The same offsets in every tick: samples that jump make a controller nervous.
        self._offsets = [stream(seed, "alpha_beta", name).normal(0.0, spread, (num, 4)) for name in self._names]
        self._states: np.ndarray | None = None  # (P, 4) x, y, vx, vy

    def update(self, reading: Reading) -> tuple[Track, ...]:
        """One track for each person who is there, in the order of reading.detections (P, 2), NaN for who is not."""
        there = ~np.isnan(reading.detections[:, 0])
        if self._states is None:
            self._states = np.full((len(there), 4), np.nan)
        new = np.isnan(self._states[:, 0])
        self._states[new, :2], self._states[new, 2:] = reading.detections[new], 0.0
        if reading.interval > 0.0:
            predicted = self._states[:, :2] + reading.interval * self._states[:, 2:]
            residual = reading.detections - predicted
            self._states[:, :2] = predicted + self._parameters.alpha * residual
            self._states[:, 2:] += self._parameters.beta / reading.interval * residual
        return tuple(
            person_track(self._names[i], reading.time, self._radii[i], self._states[i] + self._offsets[i])
            for i in np.flatnonzero(there).tolist()
        )
