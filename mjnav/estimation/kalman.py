"""Kalman filters in place of particle filters: each noise is taken for a Gaussian of its mean and std.

filterpy does the algebra; it is slow to import and needed by these alone.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.linalg import LinAlgError, cholesky, eigh

from mjnav.estimation.base import HEADING, PeopleTracker, PoseEstimator
from mjnav.estimation.likelihood import widened
from mjnav.estimation.localizer import ODOMETRY_CHANNELS, POSE_CHANNELS
from mjnav.estimation.person_motion import PersonMotion
from mjnav.estimation.tracker import DETECTION_CHANNELS
from mjnav.geometry.angles import circular_mean, wrap
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.motion.unicycle import integrate
from mjnav.noise import Distribution
from mjnav.rng import stream


def _gaussian(noise: Mapping[str, Distribution], channels: Sequence[str]) -> tuple[Array, Array]:
    """Means (c,) and diagonal covariance (c, c) of the channels, none narrower than a filter's least std."""
    widened_noise = [widened(channel, noise[channel]) for channel in channels]
    return np.array([n.mean for n in widened_noise]), np.diag([n.std**2 for n in widened_noise])


def _samples(mean: Array, covariance: Array, num: int, rng: np.random.Generator) -> Array:
    """Draws from N(mean, covariance), (num, d)."""
    return mean + rng.standard_normal((num, mean.size)) @ _root(covariance)


def _root(covariance: Array) -> Array:
    """R with R^T R = covariance (d, d), upper triangular where rounding has left it positive definite.

    Of the widest noises it does not: then R is the root of the nearest matrix that is semidefinite.
    """
    try:
        return np.asarray(cholesky(covariance), float).T
    except LinAlgError:
        values, vectors = eigh(0.5 * (covariance + covariance.T))
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)), float).T


def _residual(a: Array, b: Array) -> Array:
    """a - b of poses, the heading wrapped."""
    difference = a - b
    difference[HEADING] = wrap(difference[HEADING])
    return difference


def _mean(sigmas: Array, weights: Array) -> Array:
    """Weighted mean of poses (k, 3), circular in the heading."""
    mean = weights @ sigmas
    mean[HEADING] = circular_mean(sigmas[:, HEADING], weights)
    return mean


def _odometry_jacobians(pose: Array, twist: Array, interval: float) -> tuple[Array, Array]:
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


class KalmanLocalizer(PoseEstimator, ABC):
    """A Kalman filter of the pose, predicted by odometry and corrected by the pose sensor.

    It starts at the first pose reading less the noise's mean. `particles` are draws from its Gaussian.
    """

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, seed: int):
        super().__init__(seed)
        self._num = num_particles
        self._odometry_mean, self._odometry_covariance = _gaussian(noise, ODOMETRY_CHANNELS)
        self._pose_mean, self._pose_covariance = _gaussian(noise, POSE_CHANNELS)
        self._kalman = self._make()
        self._kalman.R = self._pose_covariance
        self._started = False
        self._stream = stream(seed, "estimation.gaussian")
        self._weights = np.full(num_particles, 1.0 / num_particles)

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading."""
        kalman, measured = self._kalman, reading.pose - self._pose_mean
        if self._started:
            self._predict(reading.odometry - self._odometry_mean, reading.interval)
            self._correct(measured)
        else:
            kalman.x, kalman.P, self._started = measured, self._pose_covariance.copy(), True
        kalman.x[HEADING] = wrap(kalman.x[HEADING])
        covariance = 0.5 * (kalman.P + kalman.P.T)
        particles = _samples(kalman.x, covariance, self._num, self._stream)
        particles[:, HEADING] = wrap(particles[:, HEADING])
        self._belief = RobotBelief(
            reading.time, particles, self._weights, kalman.x.copy(), covariance, ess=float(self._num)
        )
        return self._belief

    @abstractmethod
    def _make(self) -> Any:
        """filterpy's filter of three states and three measurements."""

    @abstractmethod
    def _predict(self, twist: Array, interval: float) -> None:
        """Moves the Gaussian by a mean twist over `interval` [s]."""

    @abstractmethod
    def _correct(self, measured: Array) -> None:
        """Conditions the Gaussian on a pose with noise of zero mean."""


class ExtendedKalmanLocalizer(KalmanLocalizer):
    """Extended Kalman filter (Thrun, Burgard & Fox 2005, table 3.3)."""

    def _make(self) -> Any:
        from filterpy.kalman import ExtendedKalmanFilter

        class UnicycleFilter(ExtendedKalmanFilter):
            def predict_x(self, u=0):
                self.x = u  # the arc's end, which is no linear function of the pose

        return UnicycleFilter(dim_x=3, dim_z=3)

    def _predict(self, twist: Array, interval: float) -> None:
        kalman = self._kalman
        kalman.F, by_twist = _odometry_jacobians(kalman.x, twist, interval)
        kalman.Q = by_twist @ self._odometry_covariance @ by_twist.T
        kalman.predict(u=integrate(kalman.x, twist[0], twist[1], interval))

    def _correct(self, measured: Array) -> None:
        self._kalman.update(measured, lambda _: np.eye(3), lambda x: x, residual=_residual)


class UnscentedKalmanLocalizer(KalmanLocalizer):
    """Unscented Kalman filter (Wan & van der Merwe 2000); the odometry's noise enters through its Jacobian."""

    def _make(self) -> Any:
        from filterpy.kalman import MerweScaledSigmaPoints, UnscentedKalmanFilter

        return UnscentedKalmanFilter(
            dim_x=3,
            dim_z=3,
            dt=1.0,  # each prediction brings its own
            hx=lambda x: x,
            fx=lambda x, dt, twist: integrate(x, twist[0], twist[1], dt),
            # alpha = 1 and kappa = 0 put no negative weight anywhere, so a covariance stays one.
            points=MerweScaledSigmaPoints(3, alpha=1.0, beta=2.0, kappa=0.0, sqrt_method=_root, subtract=_residual),
            x_mean_fn=_mean,
            z_mean_fn=_mean,
            residual_x=_residual,
            residual_z=_residual,
        )

    def _predict(self, twist: Array, interval: float) -> None:
        kalman = self._kalman
        _, by_twist = _odometry_jacobians(kalman.x, twist, interval)
        kalman.Q = by_twist @ self._odometry_covariance @ by_twist.T
        kalman.predict(dt=interval, twist=twist)

    def _correct(self, measured: Array) -> None:
        self._kalman.update(measured)


class KalmanTracker(PeopleTracker):
    """One linear Kalman filter a person, with the Gaussian of `PersonMotion`'s first two moments."""

    def __init__(
        self,
        noise: Mapping[str, Distribution],
        num_particles: int,
        radii: Sequence[float],
        seed: int,
        *,
        motion: PersonMotion | None = None,
    ):
        from filterpy.kalman import KalmanFilter

        super().__init__(radii, seed)
        self._num = num_particles
        self._motion = motion or PersonMotion()
        self._noise_mean, self._noise_covariance = _gaussian(noise, DETECTION_CHANNELS)
        self._filters = [KalmanFilter(dim_x=4, dim_z=2) for _ in self._names]
        for kalman in self._filters:
            kalman.H = np.eye(2, 4)
            kalman.R = self._noise_covariance
        self._started = False
        self._streams = [stream(seed, "estimation.gaussian", name) for name in self._names]
        self._weights = np.full(num_particles, 1.0 / num_particles)

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, after one more reading."""
        tracked = self._detected(reading)
        transition, process = self._motion.gaussian(reading.interval)
        particles, means, covariances = [], [], []
        for p, kalman in enumerate(self._filters):
            measured = np.nan_to_num(reading.detections[p]) - self._noise_mean
            there, before = p in tracked, self._started and p in self._tracked
            if there and before:
                kalman.predict(F=transition, Q=process)
                kalman.update(measured)
            else:  # a new track; of who is not there, the row is not looked at
                variance = np.append(np.diagonal(self._noise_covariance), 2 * [self._motion.walking_speed**2])
                kalman.x, kalman.P = np.append(measured, [0.0, 0.0]), np.diag(variance)
            covariances.append(0.5 * (kalman.P + kalman.P.T))
            means.append(kalman.x.copy())
            particles.append(_samples(kalman.x, covariances[p], self._num, self._streams[p]))
        self._started = True
        num = len(self._names)
        weights, ess = [self._weights] * num, [self._num] * num
        return self._conclude(reading.time, particles, weights, means, covariances, ess, tracked=tracked)
