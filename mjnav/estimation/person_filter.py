"""A Gaussian, or a few of them, of one person's position and velocity: Kalman filters that trackers choose among."""

from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np

from mjnav.estimation.gaussian import draw_gaussian, symmetrised
from mjnav.estimation.person_motion import PersonMotion
from mjnav.messages import Array


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
