"""Kalman filters of the robot's pose and of a person's state: every noise is taken for a Gaussian of its mean and std.

predict    x' = f(x) + N(0, Q)       m <- f(m),   P <- F P F^T + Q,   F the Jacobian of f
correct    z = H x + N(0, R)         m <- m + K (z - H m),   K = P H^T (H P H^T + R)^-1   (Kalman 1960)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from math import exp, pi, sqrt

import numpy as np
from numpy.linalg import LinAlgError, cholesky, eigh

from mjnav.constant import Constant
from mjnav.filters.mixture_kalman import GaussianSum
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.motion.unicycle import integrate
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.robot.estimation.base import HEADING, UNKNOWN_TWIST_STD, PoseEstimator, widened
from mjnav.robot.estimation.particle import ODOMETRY_CHANNELS, POSE_CHANNELS
from mjnav.robot.estimation.walk_filter import Detectable, StopAndGo

# ---------------------------------------------------------------------------------------- Gaussians


@dataclass(frozen=True, slots=True)
class Gaussian(Constant):
    """N(mean, covariance) of a state of d numbers."""

    mean: Array  # (d,)
    covariance: Array  # (d, d), symmetric but for what rounding leaves

    def moved(self, mean: Array, jacobian: Array, noise: Array) -> "Gaussian":
        """After a motion f: `mean` is f(m), `jacobian` F (d, d) and `noise` Q (d, d)."""
        return Gaussian(mean, jacobian @ self.covariance @ jacobian.T + noise)

    def given(self, residual: Array, sees: Array, noise: Array) -> "Gaussian":
        """Conditioned on a measurement by its `residual` z - H m (k,), H = `sees` (k, d) and `noise` R (k, k).

        In Joseph's form, (I - K H) P (I - K H)^T + K R K^T, which rounding leaves positive semidefinite.
        """
        from scipy.linalg import inv  # slow to import; the estimators that condition import it before the first tick

        cross = self.covariance @ sees.T
        gain = cross @ inv(sees @ cross + noise)
        rest = np.eye(len(self.mean)) - gain @ sees
        return Gaussian(self.mean + gain @ residual, rest @ self.covariance @ rest.T + gain @ noise @ gain.T)

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """States from it, (num, d)."""
        return self.mean + rng.standard_normal((num, self.mean.size)) @ root(symmetrised(self.covariance))


def noise_moments(noise: Mapping[str, Distribution], channels: Sequence[str]) -> tuple[Array, Array]:
    """Means (c,) and diagonal covariance (c, c) of the channels, none narrower than a filter's least std."""
    widened_noise = [widened(channel, noise[channel]) for channel in channels]
    return np.array([n.mean for n in widened_noise]), np.diag([n.std**2 for n in widened_noise])


def root(covariance: Array) -> Array:
    """R with R^T R = covariance (d, d), upper triangular where rounding has left it positive definite.

    Of the widest noises it does not: then R is the root of the nearest matrix that is semidefinite.
    """
    try:
        return np.asarray(cholesky(covariance), float).T
    except LinAlgError:
        values, vectors = eigh(symmetrised(covariance))
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)), float).T


def symmetrised(matrix: Array) -> Array:
    """The symmetric part of a matrix (d, d), without the asymmetry that rounding leaves."""
    return 0.5 * (matrix + matrix.T)


# -------------------------------------------------- extended Kalman filter of the pose (x, y, heading)


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


def pose_moved(pose: Gaussian, twist: Array, covariance: Array, interval: float) -> Gaussian:
    """A pose after a twist (v, omega) known with a covariance (2, 2) over `interval` [s].

    The mean goes along the arc, the covariance by its Jacobians (Thrun, Burgard & Fox 2005, table 3.3).
    """
    by_pose, by_twist = odometry_jacobians(pose.mean, twist, interval)
    mean = integrate(pose.mean, twist[0], twist[1], interval)
    return pose.moved(mean, by_pose, by_twist @ covariance @ by_twist.T)


def pose_given(pose: Gaussian, measured: Array, covariance: Array) -> Gaussian:
    """A pose conditioned on one (3,) that was measured with an error of zero mean and `covariance` (3, 3)."""
    after = pose.given(pose_residual(measured, pose.mean), np.eye(3), covariance)
    after.mean[HEADING] = wrap(after.mean[HEADING])
    return after


def pose_belief(
    pose: Gaussian, time: float, num: int, rng: np.random.Generator, recovered: bool = False
) -> RobotBelief:
    """The belief at `time` [s]; its `num` particles are draws from the Gaussian, equally weighted."""
    particles = pose.draw(num, rng)
    particles[:, HEADING] = wrap(particles[:, HEADING])
    weights = np.full(num, 1.0 / num)
    return RobotBelief(time, particles, weights, pose.mean, symmetrised(pose.covariance), float(num), recovered)


class KalmanLocalizer(PoseEstimator):
    """By an extended Kalman filter of the pose, predicted by odometry and corrected by the pose sensor.

    It starts at the first pose reading less the noise's mean. `particles` are draws from its Gaussian.
    """

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, seed: int):
        super().__init__(seed)
        import_module("scipy.linalg")
        self._num = num_particles
        self._odometry_mean, self._odometry_covariance = noise_moments(noise, ODOMETRY_CHANNELS)
        self._pose_mean, self._pose_covariance = noise_moments(noise, POSE_CHANNELS)
        self._pose: Gaussian | None = None
        self._stream = stream(seed, "estimation.gaussian")

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading."""
        measured, pose = reading.pose - self._pose_mean, self._pose
        if pose is None:
            measured[HEADING] = wrap(measured[HEADING])
            pose = Gaussian(measured, self._pose_covariance)
        else:
            covariance = self._odometry_covariance
            if "odometry" in reading.dropped:
                covariance = covariance + np.diag(np.square(UNKNOWN_TWIST_STD))
            pose = pose_moved(pose, reading.odometry - self._odometry_mean, covariance, reading.interval)
            if "pose" not in reading.dropped:
                pose = pose_given(pose, measured, self._pose_covariance)
        self._pose = pose
        self._belief = pose_belief(pose, reading.time, self._num, self._stream)
        return self._belief


# -------------------------------------------------------- linear Kalman filter of a person (x, y, vx, vy)


class KalmanPersonFilter:
    """One linear Kalman filter, with the Gaussian of the motion's and of the measurement's first two moments."""

    def __init__(self, motion: StopAndGo):
        import_module("scipy.linalg")
        self._motion = motion
        self._state = Gaussian(np.zeros(4), np.eye(4))

    @property
    def mean(self) -> Array:
        """(4,)"""
        return self._state.mean

    @property
    def covariance(self) -> Array:
        """(4, 4), symmetric."""
        return symmetrised(self._state.covariance)

    def start(self, measured: Array, noise: GaussianSum) -> None:
        """Forgets all but a measured position (2,) [m]; a component of the velocity is N(0, walking_speed^2)."""
        spread = np.zeros((4, 4))
        spread[:2, :2], spread[2:, 2:] = noise.variance, self._motion.walking_speed**2 * np.eye(2)
        self._state = Gaussian(np.append(measured - noise.mean, [0.0, 0.0]), spread)

    def predict(self, interval: float) -> None:
        """Constant velocity over `interval` [s], with a Gaussian change of it; the position moves by the mean."""
        transition, gain = np.eye(4), np.zeros((4, 2))
        transition[:2, 2:] = interval * np.eye(2)
        gain[:2], gain[2:] = 0.5 * interval * np.eye(2), np.eye(2)
        of_velocity, of_position = self._motion.variances(interval)
        noise = of_velocity * gain @ gain.T + of_position * np.diag([1.0, 1.0, 0.0, 0.0])
        self._state = self._state.moved(transition @ self._state.mean, transition, noise)

    def correct(self, measured: Array, noise: GaussianSum, *, age: float = 0.0, floor: float = 0.0) -> float:
        """Conditions on the position (2,) [m] that was measured `age` [s] before; returns its density [1/m^2] before.

        z = x - age v + error. `floor` [1/m^2] is added to the density.
        """
        sees, variance = seen_before(age), noise.variance
        density = self.density(measured, noise, age=age) + floor
        self._state = self._state.given(measured - noise.mean - sees @ self._state.mean, sees, variance)
        return density

    def density(self, measured: Array, noise: GaussianSum, *, age: float = 0.0) -> float:
        """Of a position (2,) [m] measured `age` [s] before, [1/m^2]."""
        sees = seen_before(age)
        x, y = (measured - noise.mean - sees @ self._state.mean).tolist()
        (a, b), (_, d) = (sees @ self._state.covariance @ sees.T + noise.variance).tolist()
        determinant = a * d - b * b
        squared = (d * x * x - 2.0 * b * x * y + a * y * y) / determinant
        return exp(-0.5 * squared) / (2.0 * pi * sqrt(determinant))

    def missed(self, detectable: Detectable) -> float:
        """The probability of a detection under the Gaussian, which it leaves as it is.

        By Gauss-Hermite quadrature along its widest axis: 2/3 at the mean, 1/6 at sqrt(3) std to either side.
        """
        mean, (values, vectors) = self.mean[:2], eigh(self.covariance[:2, :2])
        out = sqrt(3.0 * max(float(values[-1]), 0.0)) * vectors[:, -1]
        return float(np.array([4.0, 1.0, 1.0]) / 6.0 @ detectable(np.stack([mean, mean + out, mean - out])))

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """Equally weighted states, (num, 4)."""
        return self._state.draw(num, rng)


def seen_before(age: float) -> Array:
    """H (2, 4) of a position `age` [s] before: (I, -age I)."""
    return np.hstack([np.eye(2), -age * np.eye(2)])
