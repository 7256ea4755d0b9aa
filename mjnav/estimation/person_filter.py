"""Kalman filters of one person's position and velocity: a single linear one, and an interacting multiple model filter.

The trackers choose between them. The interacting multiple model filter stands for stop and go: one Kalman filter a mode
of motion, mixed by a Markov chain. Source: Blom & Bar-Shalom, IEEE Transactions on Automatic Control 33 (1988) 780.
filterpy does the algebra.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from math import exp, log, pi
from sys import float_info
from typing import Any, Protocol

import numpy as np

from mjnav.estimation.base import draw_gaussian, symmetrised
from mjnav.estimation.person_motion import PersonMotion, StopAndGo
from mjnav.messages import Array

# ------------------------------------------------------------------------------------- one Gaussian


class PersonFilter(ABC):
    """A belief of (x, y, vx, vy) that is moved by a model of how people walk and conditioned on positions."""

    @property
    @abstractmethod
    def mean(self) -> Array:
        """(4,), a copy."""

    @property
    @abstractmethod
    def covariance(self) -> Array:
        """(4, 4), symmetric."""

    @abstractmethod
    def start(self, position: Array, covariance: Array) -> None:
        """Forgets what was believed: a position (2,) known with a covariance (2, 2), of the velocity nothing."""

    @abstractmethod
    def predict(self, interval: float) -> None:
        """Moves by `interval` [s]."""

    @abstractmethod
    def correct(self, position: Array, covariance: Array, age: float = 0.0) -> None:
        """Conditions on a position (2,), measured `age` [s] before with an error of zero mean and `covariance` (2, 2).

        z = x - age v + error.
        """

    @abstractmethod
    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """States drawn from the belief, (num, 4)."""


def state_at(position: Array, covariance: Array, speed_std: float) -> tuple[Array, Array]:
    """Mean and covariance of who is at a position known with a covariance (2, 2), each velocity ~ N(0, speed_std^2)."""
    spread = np.zeros((4, 4))
    spread[:2, :2], spread[2:, 2:] = covariance, speed_std**2 * np.eye(2)
    return np.append(position, [0.0, 0.0]), spread


def seen_before(age: float) -> Array:
    """H (2, 4) of a position `age` [s] before: (I, -age I)."""
    return np.hstack([np.eye(2), -age * np.eye(2)])


class LinearMotion(Protocol):
    """How people walk, by one linear model."""

    @property
    def walking_speed(self) -> float:
        """Std of a velocity component of which nothing is known [m/s]."""
        ...

    def gaussian(self, interval: float) -> tuple[Array, Array]:
        """Transition matrix and covariance (4, 4) of an interval [s]."""
        ...


class KalmanPersonFilter(PersonFilter):
    """One linear Kalman filter, with the Gaussian of the motion's first two moments."""

    def __init__(self, motion: LinearMotion | None = None):
        from filterpy.kalman import KalmanFilter

        self._motion = motion or PersonMotion()
        self._kalman = KalmanFilter(dim_x=4, dim_z=2)

    @property
    def mean(self) -> Array:
        """(4,), a copy."""
        return self._kalman.x.copy()

    @property
    def covariance(self) -> Array:
        """(4, 4), symmetric."""
        return symmetrised(self._kalman.P)

    def start(self, position: Array, covariance: Array) -> None:
        """At a position (2,), a component of the velocity ~ N(0, walking_speed^2)."""
        self._kalman.x, self._kalman.P = state_at(position, covariance, self._motion.walking_speed)

    def predict(self, interval: float) -> None:
        """Constant velocity over `interval` [s], with the Gaussian change of velocity."""
        transition, process = self._motion.gaussian(interval)
        self._kalman.predict(F=transition, Q=process)

    def correct(self, position: Array, covariance: Array, age: float = 0.0) -> None:
        """By the Kalman gain."""
        self._kalman.update(position, R=covariance, H=seen_before(age))

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """From the Gaussian, (num, 4)."""
        return draw_gaussian(self._kalman.x, self.covariance, num, rng)


# ---------------------------------------------------------------------- interacting multiple models


MODES = ("stand", "walk", "turn")


class ImmPersonFilter(PersonFilter):
    """`StopAndGo` with its three ways to go on as the modes of a Markov chain.

    Within an interval T, with the probabilities p of a stop, a turn and a start,

        mode    v becomes                     next: stand        walk                  turn
        stand   N(0, unrest^2 I)                    1 - p_start  0                     p_start
        walk    v + N(0, sway^2 T I)                p_stop       1 - p_stop - p_turn   p_turn
        turn    N(0, walking_speed^2 I)             p_stop       1 - p_stop - p_turn   p_turn

    and the position moves by the mean of the old and the new velocity times T. A filter j starts each interval from
    the mixture of all filters i with weights mu_ij = p_ij mu_i / c_j, c_j = sum_i p_ij mu_i; after a measurement of
    likelihood L_j under its prediction, mode j has the probability mu_j = L_j c_j / sum_k L_k c_k.
    """

    def __init__(self, motion: StopAndGo | None = None):
        self._motion = motion or StopAndGo()
        self._bank = _mode_bank()

    @property
    def mean(self) -> Array:
        """The moments of the mixture: (4,), a copy."""
        return self._bank.x.copy()

    @property
    def covariance(self) -> Array:
        """(4, 4), symmetric."""
        return symmetrised(self._bank.P)

    @property
    def mode_probabilities(self) -> Array:
        """Of MODES, (3,)."""
        return self._bank.mu.copy()

    def start(self, position: Array, covariance: Array) -> None:
        """Who is new walks or stands, with the motion's probability."""
        unrest, speed = self._motion.unrest, self._motion.walking_speed
        for kalman, speed_std in zip(self._bank.filters, (unrest, speed, speed), strict=True):
            kalman.x, kalman.P = state_at(position, covariance, speed_std)
        walking = self._motion.walking
        self._bank.become(np.array([1.0 - walking, walking, 0.0]))

    def predict(self, interval: float) -> None:
        """The modes of the next interval; one of no length changes nothing."""
        if interval <= 0.0:
            return
        chain, transitions, covariances = self._motion.modes(interval)
        for kalman, transition, covariance in zip(self._bank.filters, transitions, covariances, strict=True):
            kalman.F, kalman.Q = transition, covariance
        self._bank.move(chain)

    def correct(self, position: Array, covariance: Array, age: float = 0.0) -> None:
        """Each filter by its gain; the modes by how likely each held the position."""
        for kalman in self._bank.filters:
            kalman.H, kalman.R = seen_before(age), covariance
        self._bank.weigh(position)

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """From the mixture of the modes' Gaussians, of which `mean` and `covariance` are the moments."""
        counts = rng.multinomial(num, self._bank.mu)
        rows: Sequence[Array] = [
            draw_gaussian(kalman.x, symmetrised(kalman.P), count, rng)
            for kalman, count in zip(self._bank.filters, counts.tolist(), strict=True)
        ]
        return np.concatenate(rows)


def _mode_bank() -> Any:
    """filterpy's estimator of a filter a mode, whose chain and whose order of steps may change from step to step."""
    from filterpy.kalman import IMMEstimator, KalmanFilter

    class ModeFilter(KalmanFilter):
        @property
        def likelihood(self) -> float:
            """N(y; 0, S) of two numbers; filterpy's own takes the tenfold time for S of any size."""
            squared = self.y @ self.SI @ self.y
            determinant = self.S[0, 0] * self.S[1, 1] - self.S[0, 1] * self.S[1, 0]
            return max(exp(-0.5 * squared - 0.5 * log(determinant) - log(2.0 * pi)), float_info.min)

    class ModeBank(IMMEstimator):
        def become(self, probabilities: Array) -> None:
            """Modes of other probabilities."""
            self.mu = probabilities
            self._compute_state_estimate()

        def move(self, chain: Array) -> None:
            """Mixes by a chain, of which row i says where mode i goes, and predicts."""
            self.M = chain
            self._compute_mixing_probabilities()
            self.predict()
            self.become(self.cbar)  # filterpy's own moments of a prediction weigh it by the modes before

        def weigh(self, position: Array) -> None:
            self.cbar = self.mu
            self.update(position)

    filters = [ModeFilter(dim_x=4, dim_z=2) for _ in MODES]
    for kalman in filters:
        kalman.x = np.zeros(4)
    num = len(MODES)
    return ModeBank(filters, np.full(num, 1.0 / num), np.full((num, num), 1.0 / num))
