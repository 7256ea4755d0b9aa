"""How the trackers believe that people move."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import ArrayLike

from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Cube, Matrix
from mjnav.messages import Array


@dataclass(frozen=True, slots=True)
class PersonMotion:
    """Constant velocity with small changes always, and now and then another velocity altogether.

    Within an interval T the velocity v becomes

        v + N(0, sway^2 T I)          with probability 1 - q,  q = 1 - exp(-turn_rate T)
        N(0, walking_speed^2 I)       with probability q (1 - stop_share): a start or a turn
        0                             with probability q stop_share: a stop

    and the position moves by the mean of the old and the new velocity times T. A single Gaussian wide enough for turns
    would be useless between them: constant-velocity errors of recorded people have kurtosis 6 to 19.

    walking_speed [m/s]     std of a velocity component of which nothing is known; people walk at 1 to 1.5 m/s
    sway          [m/s/√s]  of a straight walk; also lets a few hundred particles follow a turn that none of them made
    turn_rate     [1/s]     of stops, starts and turns; more often than people do, for the same reason
    stop_share              of them that are stops: every other one, as a walk that stops goes on again
    """

    walking_speed: float = 1.0
    sway: float = 0.2
    turn_rate: float = 0.5
    stop_share: float = 0.5

    def turn_probability(self, interval: float) -> float:
        """q: that the velocity is another one after `interval` [s]."""
        return float(-np.expm1(-self.turn_rate * interval))

    def predict(self, state: Array, interval: float, uniform: ArrayLike, normal: ArrayLike) -> Array:
        """States (..., 4) after `interval` [s], by draws uniform (...) from [0, 1) and normal (..., 2) from N(0, 1)."""
        q = self.turn_probability(interval)
        state = np.asarray(state, float)
        filters = state.reshape(-1, *state.shape[-2:]) if state.ndim > 1 else state.reshape(1, 1, 4)
        shape = filters.shape[:2]
        moved = _predict(
            filters,
            np.ascontiguousarray(np.reshape(uniform, shape)),
            np.ascontiguousarray(np.reshape(normal, (*shape, 2))),
            interval,
            self.sway * sqrt(interval),
            self.walking_speed,
            q,
            q * self.stop_share,
        )
        return moved.reshape(state.shape)

    def gaussian(self, interval: float) -> tuple[Array, Array]:
        """Transition matrix and covariance (4, 4) of a constant-velocity model with a Gaussian change of velocity.

        Its variance is the mixture's for a person whose own velocity is N(0, walking_speed^2 I):
        (1 - q) sway^2 T + q (2 - stop_share) walking_speed^2 in each component.
        """
        q = self.turn_probability(interval)
        variance = (1.0 - q) * self.sway**2 * interval + q * (2.0 - self.stop_share) * self.walking_speed**2
        transition, gain = np.eye(4), np.zeros((4, 2))
        transition[:2, 2:] = interval * np.eye(2)
        gain[:2], gain[2:] = 0.5 * interval * np.eye(2), np.eye(2)
        return transition, variance * gain @ gain.T


@kernel
def _predict(
    state: Cube,
    uniform: Matrix,
    normal: Cube,
    interval: float,
    sway: float,
    walking_speed: float,
    turn: float,
    stop: float,
):
    """`PersonMotion.predict` of P x n states (P, n, 4); a velocity changes where uniform < turn, to 0 where < stop."""
    moved = np.empty(state.shape)
    for p in range(state.shape[0]):
        for i in range(state.shape[1]):
            u = uniform[p, i]
            std = sway if u >= turn else walking_speed if u >= stop else 0.0
            for axis in range(2):
                before = state[p, i, 2 + axis]
                after = std * normal[p, i, axis] + (before if u >= turn else 0.0)
                moved[p, i, axis] = state[p, i, axis] + 0.5 * interval * (before + after)
                moved[p, i, 2 + axis] = after
    return moved
