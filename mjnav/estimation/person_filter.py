"""A Gaussian, or a few of them, of one person's position and velocity: Kalman filters that trackers choose among."""

from abc import ABC, abstractmethod

import numpy as np

from mjnav.estimation.gaussian import draw_gaussian, symmetrised
from mjnav.estimation.person_motion import PersonMotion
from mjnav.messages import Array


class PersonFilter(ABC):
    """A belief of (x, y, vx, vy) that is moved by `PersonMotion` and conditioned on positions."""

    def __init__(self, motion: PersonMotion | None = None):
        self._motion = motion or PersonMotion()

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
    def correct(self, position: Array, covariance: Array) -> None:
        """Conditions on a position (2,) that was measured with an error of zero mean and `covariance` (2, 2)."""

    @abstractmethod
    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """States drawn from the belief, (num, 4)."""

    def _state_at(self, position: Array, covariance: Array, speed_std: float) -> tuple[Array, Array]:
        """Mean and covariance of who stands or walks at a position, a component of the velocity ~ N(0, speed_std^2)."""
        spread = np.zeros((4, 4))
        spread[:2, :2], spread[2:, 2:] = covariance, speed_std**2 * np.eye(2)
        return np.append(position, [0.0, 0.0]), spread


class KalmanPersonFilter(PersonFilter):
    """One linear Kalman filter, with the Gaussian of `PersonMotion`'s first two moments."""

    def __init__(self, motion: PersonMotion | None = None):
        from filterpy.kalman import KalmanFilter

        super().__init__(motion)
        self._kalman = KalmanFilter(dim_x=4, dim_z=2)
        self._kalman.H = np.eye(2, 4)

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
        self._kalman.x, self._kalman.P = self._state_at(position, covariance, self._motion.walking_speed)

    def predict(self, interval: float) -> None:
        """Constant velocity over `interval` [s], with the Gaussian change of velocity."""
        transition, process = self._motion.gaussian(interval)
        self._kalman.predict(F=transition, Q=process)

    def correct(self, position: Array, covariance: Array) -> None:
        """On a position (2,) measured with `covariance` (2, 2)."""
        self._kalman.update(position, R=covariance)

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """From the Gaussian, (num, 4)."""
        return draw_gaussian(self._kalman.x, self.covariance, num, rng)
