"""Kalman filters of the robot's pose and of people's states: every noise is taken for a Gaussian of its mean and std.

A filter of the pose is a Gaussian that is moved by twists and conditioned on poses. filterpy does the algebra; it is
slow to import, and only the Kalman filters need it.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mjnav.estimation.base import (
    HEADING,
    UNKNOWN_TWIST_STD,
    PeopleTracker,
    PoseEstimator,
    draw_gaussian,
    noise_moments,
    root,
    symmetrised,
)
from mjnav.estimation.localizer import ODOMETRY_CHANNELS, POSE_CHANNELS
from mjnav.estimation.person_filter import ImmPersonFilter, KalmanPersonFilter, LinearMotion, PersonFilter
from mjnav.estimation.tracker import DETECTION_CHANNELS
from mjnav.geometry.angles import circular_mean, wrap
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.motion.unicycle import integrate
from mjnav.noise import Distribution
from mjnav.rng import stream

# ------------------------------------------------------------------------------ filters of the pose


def pose_residual(a: Array, b: Array) -> Array:
    """a - b of poses (3,), the heading wrapped."""
    difference = a - b
    difference[HEADING] = wrap(difference[HEADING])
    return difference


def odometry_jacobians(pose: Array, twist: Array, interval: float) -> tuple[Array, Array]:
    """Derivatives of the unicycle's end pose by the pose, (3, 3), and by (v, omega), (3, 2).

    The arc's midpoint form x' = x + v T cos(theta + omega T/2) is differentiated; the factor sin(h)/h that it leaves
    out differs from 1 by h^2/6, h = omega T/2, which is 1e-3 at 1.5 rad/s and 0.1 s.
    """
    v, omega = twist
    direction = pose[HEADING] + 0.5 * omega * interval
    c, s = np.cos(direction), np.sin(direction)
    by_pose = np.array([[1.0, 0.0, -v * interval * s], [0.0, 1.0, v * interval * c], [0.0, 0.0, 1.0]])
    half = 0.5 * v * interval**2
    by_twist = np.array([[interval * c, -half * s], [interval * s, half * c], [0.0, interval]])
    return by_pose, by_twist


class PoseFilter(ABC):
    """N(mean, covariance) of (x, y, heading)."""

    def __init__(self):
        self._kalman = self._make()

    @property
    def mean(self) -> Array:
        """(3,), a copy."""
        return self._kalman.x.copy()

    @property
    def covariance(self) -> Array:
        """(3, 3), symmetric."""
        return symmetrised(self._kalman.P)

    def start(self, mean: Array, covariance: Array) -> None:
        """Forgets what was believed."""
        self._kalman.x, self._kalman.P = mean.copy(), covariance.copy()
        self._wrap()

    @abstractmethod
    def predict(self, twist: Array, covariance: Array, interval: float) -> None:
        """Moves by a twist (v, omega) that is known with a covariance (2, 2), over `interval` [s]."""

    def correct(self, measured: Array, covariance: Array) -> None:
        """Conditions on a pose (3,) that was measured with an error of zero mean and `covariance` (3, 3)."""
        self._correct(measured, covariance)
        self._wrap()

    def belief(self, time: float, num: int, rng: np.random.Generator, recovered: bool = False) -> RobotBelief:
        """The Gaussian at `time` [s]; its `num` particles are draws from it, equally weighted."""
        covariance = self.covariance
        particles = draw_gaussian(self._kalman.x, covariance, num, rng)
        particles[:, HEADING] = wrap(particles[:, HEADING])
        weights = np.full(num, 1.0 / num)
        return RobotBelief(time, particles, weights, self.mean, covariance, float(num), recovered)

    def _wrap(self) -> None:
        self._kalman.x[HEADING] = wrap(self._kalman.x[HEADING])

    @abstractmethod
    def _make(self) -> Any:
        """filterpy's filter of three states and three measurements."""

    @abstractmethod
    def _correct(self, measured: Array, covariance: Array) -> None: ...


class ExtendedPoseFilter(PoseFilter):
    """Extended Kalman filter (Thrun, Burgard & Fox 2005, table 3.3)."""

    def _make(self) -> Any:
        from filterpy.kalman import ExtendedKalmanFilter

        class UnicycleFilter(ExtendedKalmanFilter):
            def predict_x(self, u=0):
                self.x = u  # the arc's end, which is no linear function of the pose

        return UnicycleFilter(dim_x=3, dim_z=3)

    def predict(self, twist: Array, covariance: Array, interval: float) -> None:
        """The mean along the arc, the covariance by its Jacobians."""
        kalman = self._kalman
        kalman.F, by_twist = odometry_jacobians(kalman.x, twist, interval)
        kalman.Q = by_twist @ covariance @ by_twist.T
        kalman.predict(u=integrate(kalman.x, twist[0], twist[1], interval))

    def _correct(self, measured: Array, covariance: Array) -> None:
        self._kalman.update(measured, lambda _: np.eye(3), lambda x: x, R=covariance, residual=pose_residual)


class UnscentedPoseFilter(PoseFilter):
    """Unscented Kalman filter (Wan & van der Merwe 2000); the twist's noise enters through its Jacobian."""

    def _make(self) -> Any:
        from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

        return UnscentedKalmanFilter(
            dim_x=3,
            dim_z=3,
            dt=1.0,  # each prediction brings its own
            hx=lambda x: x,
            fx=lambda x, dt, twist: integrate(x, twist[0], twist[1], dt),
            # alpha = 1 and kappa = 0 put no negative weight anywhere, so a covariance stays one.
            points=MerweScaledSigmaPoints(3, alpha=1.0, beta=2.0, kappa=0.0, sqrt_method=root, subtract=pose_residual),
            x_mean_fn=_mean,
            z_mean_fn=_mean,
            residual_x=pose_residual,
            residual_z=pose_residual,
        )

    def predict(self, twist: Array, covariance: Array, interval: float) -> None:
        """Sigma points along their arcs."""
        kalman = self._kalman
        _, by_twist = odometry_jacobians(kalman.x, twist, interval)
        kalman.Q = by_twist @ covariance @ by_twist.T
        kalman.predict(dt=interval, twist=twist)

    def _correct(self, measured: Array, covariance: Array) -> None:
        kalman = self._kalman
        kalman.sigmas_f = kalman.points_fn.sigma_points(kalman.x, kalman.P)  # filterpy's are those of a prediction
        kalman.update(measured, R=covariance)


def _mean(sigmas: Array, weights: Array) -> Array:
    """Weighted mean of poses (k, 3), circular in the heading."""
    mean = weights @ sigmas
    mean[HEADING] = circular_mean(sigmas[:, HEADING], weights)
    return mean


# --------------------------------------------------------------------------------------- localizers


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


# ----------------------------------------------------------------------------------------- trackers


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
