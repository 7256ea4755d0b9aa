"""Rivals of the particle tracker by the lidar: the same lives and assignments, each track by a Kalman filter or IMM."""

from collections.abc import Callable
from math import sqrt

import numpy as np
from numpy.linalg import eigh

from mjnav.estimation.lidar.detector import Detector
from mjnav.estimation.lidar.track_filter import SCAN_ERROR, Detectable
from mjnav.estimation.lidar.tracker import LidarTracker, mahalanobis
from mjnav.estimation.person_filter import ImmPersonFilter, KalmanPersonFilter, PersonFilter
from mjnav.estimation.person_motion import StopAndGo
from mjnav.messages import Array
from mjnav.scenarios.spec import Scenario

ERROR_VARIANCE = float(SCAN_ERROR.variance[0, 0])  # of a detection's error, in units of its covariance


class GaussianTrackFilter:
    """A `PersonFilter` as the filter of a track; a detection's error is the Gaussian of its first two moments."""

    def __init__(self, person: PersonFilter):
        self._person = person

    @property
    def mean(self) -> Array:
        """(4,)"""
        return self._person.mean

    @property
    def covariance(self) -> Array:
        """(4, 4)"""
        return self._person.covariance

    def start(self, position: Array, covariance: Array) -> None:
        """See `TrackFilter`."""
        self._person.start(position, ERROR_VARIANCE * covariance)

    def predict(self, interval: float) -> None:
        """See `TrackFilter`."""
        self._person.predict(interval)

    def correct(self, position: Array, covariance: Array, age: float) -> None:
        """See `TrackFilter`."""
        self._person.correct(position, ERROR_VARIANCE * covariance, age)

    def log_density(self, positions: Array, covariances: Array, ages: Array) -> Array:
        """See `TrackFilter`."""
        moments = self.mean[None], self.covariance[None]
        return mahalanobis(*moments, positions, ERROR_VARIANCE * covariances, ages)[1][0]

    def missed(self, detectable: Detectable) -> float:
        """The probability of a detection under the Gaussian, which it leaves as it is.

        By Gauss-Hermite quadrature along its widest axis: 2/3 at the mean, 1/6 at sqrt(3) std to either side.
        """
        mean, (values, vectors) = self.mean[:2], eigh(self.covariance[:2, :2])
        out = sqrt(3.0 * max(float(values[-1]), 0.0)) * vectors[:, -1]
        return float(np.array([4.0, 1.0, 1.0]) / 6.0 @ detectable(np.stack([mean, mean + out, mean - out])))

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """See `TrackFilter`."""
        return self._person.draw(num, rng)


class KalmanLidarTracker(LidarTracker):
    """Each track by one linear Kalman filter."""

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> LidarTracker:
        """With the scenario's lidar and map."""
        return _tracker(lambda: KalmanPersonFilter(StopAndGo()), scenario, seed)


class ImmLidarTracker(LidarTracker):
    """Each track by an interacting multiple model filter of standing, walking and turning."""

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> LidarTracker:
        """With the scenario's lidar and map."""
        return _tracker(ImmPersonFilter, scenario, seed)


def _tracker(make: Callable[[], PersonFilter], scenario: Scenario, seed: int) -> LidarTracker:
    make()  # filterpy is loaded before the run, not with the first track
    num = scenario.estimation.obstacles.particles
    return LidarTracker(Detector.of(scenario), lambda *_: GaussianTrackFilter(make()), num, seed)
