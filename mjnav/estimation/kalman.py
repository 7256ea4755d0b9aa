"""Kalman filters in place of particle filters: each noise is taken for a Gaussian of its mean and std."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np

from mjnav.estimation.base import UNKNOWN_TWIST_STD, PeopleTracker, PoseEstimator
from mjnav.estimation.gaussian import noise_moments
from mjnav.estimation.imm import ImmPersonFilter
from mjnav.estimation.localizer import ODOMETRY_CHANNELS, POSE_CHANNELS
from mjnav.estimation.person_filter import KalmanPersonFilter, LinearMotion, PersonFilter
from mjnav.estimation.pose_filter import ExtendedPoseFilter, PoseFilter, UnscentedPoseFilter
from mjnav.estimation.tracker import DETECTION_CHANNELS
from mjnav.messages import Reading, RobotBelief, Track
from mjnav.noise import Distribution
from mjnav.rng import stream


class KalmanLocalizer(PoseEstimator, ABC):
    """A Kalman filter of the pose, predicted by odometry and corrected by the pose sensor.

    It starts at the first pose reading less the noise's mean. `particles` are draws from its Gaussian.
    """

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, seed: int):
        super().__init__(seed)
        self._num = num_particles
        self._odometry_mean, self._odometry_covariance = noise_moments(noise, ODOMETRY_CHANNELS)
        self._pose_mean, self._pose_covariance = noise_moments(noise, POSE_CHANNELS)
        self._filter = self._make()
        self._started = False
        self._stream = stream(seed, "estimation.gaussian")

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading."""
        measured = reading.pose - self._pose_mean
        if self._started:
            covariance = self._odometry_covariance
            if "odometry" in reading.dropped:
                covariance = covariance + np.diag(np.square(UNKNOWN_TWIST_STD))
            self._filter.predict(reading.odometry - self._odometry_mean, covariance, reading.interval)
            if "pose" not in reading.dropped:
                self._filter.correct(measured, self._pose_covariance)
        else:
            self._filter.start(measured, self._pose_covariance)
            self._started = True
        self._belief = self._filter.belief(reading.time, self._num, self._stream)
        return self._belief

    @abstractmethod
    def _make(self) -> PoseFilter:
        """The filter of the pose."""


class ExtendedKalmanLocalizer(KalmanLocalizer):
    """By an extended Kalman filter."""

    def _make(self) -> PoseFilter:
        return ExtendedPoseFilter()


class UnscentedKalmanLocalizer(KalmanLocalizer):
    """By an unscented Kalman filter."""

    def _make(self) -> PoseFilter:
        return UnscentedPoseFilter()


class GaussianTracker(PeopleTracker, ABC):
    """One Kalman filter, or several that interact, for each person; detections come with their identity."""

    def __init__(
        self,
        noise: Mapping[str, Distribution],
        num_particles: int,
        radii: Sequence[float],
        seed: int,
    ):
        super().__init__(radii, seed)
        self._num = num_particles
        self._noise_mean, self._noise_covariance = noise_moments(noise, DETECTION_CHANNELS)
        self._filters = [self._make() for _ in self._names]
        self._started = False
        self._streams = [stream(seed, "estimation.gaussian", name) for name in self._names]
        self._weights = np.full(num_particles, 1.0 / num_particles)

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, after one more reading."""
        tracked = self._detected(reading)
        for p, person in enumerate(self._filters):
            measured = np.nan_to_num(reading.detections[p]) - self._noise_mean
            if self._started and p in tracked and p in self._tracked:
                person.predict(reading.interval)
                if "detections" not in reading.dropped:
                    person.correct(measured, self._noise_covariance)
            else:  # a new track; of who is not there, the row is not looked at
                person.start(measured, self._noise_covariance)
        self._started = True
        num = len(self._names)
        return self._conclude(
            reading.time,
            [person.draw(self._num, rng) for person, rng in zip(self._filters, self._streams, strict=True)],
            [self._weights] * num,
            [person.mean for person in self._filters],
            [person.covariance for person in self._filters],
            [self._num] * num,
            tracked=tracked,
        )

    @abstractmethod
    def _make(self) -> PersonFilter:
        """A person's filter."""


class KalmanTracker(GaussianTracker):
    """By a linear Kalman filter."""

    def __init__(
        self,
        noise: Mapping[str, Distribution],
        num_particles: int,
        radii: Sequence[float],
        seed: int,
        *,
        motion: LinearMotion | None = None,
    ):
        self._motion = motion
        super().__init__(noise, num_particles, radii, seed)

    def _make(self) -> PersonFilter:
        return KalmanPersonFilter(self._motion)


class ImmTracker(GaussianTracker):
    """By an interacting multiple model filter of standing, walking and turning."""

    def _make(self) -> PersonFilter:
        return ImmPersonFilter()
