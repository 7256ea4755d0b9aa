"""Bootstrap particle filters of the robot's pose and of people's positions and velocities, for readings with noise.

    predict    x_i drawn from the motion: odometry less draws of its noise, or how people walk
    correct    w_i <- w_i prod_c [(1 - epsilon) p_c(z_c - x_i,c) + floor]   (Gordon, Salmond & Smith 1993)
    resample   systematically, where the effective sample size is low, and roughened
    recover    from the reading alone, where the belief explains the readings no more

The noise counts as it is and is not taken for a Gaussian. Several bodies are computed side by side.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from mjnav.compile.compiled import Cube, Matrix, Vector, kernel
from mjnav.filters.particles import ess, resample, reweigh, weighted_moments
from mjnav.geometry.angles import wrap, wrapped
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.motion.unicycle import integrate_rows
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.robot.estimation.base import (
    HEADING,
    UNKNOWN_TWIST_STD,
    FilterSettings,
    Likelihood,
    PeopleTracker,
    PoseEstimator,
    Posterior,
    widened,
)

# ---------------------------------------------------------------------- correction and resampling


class Bootstrap:
    """State of B bodies' filters: the particles to predict from, and their weights."""

    def __init__(
        self,
        bodies: Sequence[str],
        likelihoods: Sequence[Likelihood],
        seed: int,
        settings: FilterSettings,
        *,
        heading: int = -1,
    ):
        """`likelihoods` has one a channel; column `heading` of the particles is an angle."""
        self._likelihoods = tuple(likelihoods)
        self._least = np.array([[2.0 * model.floor] for model in likelihoods])  # mean density of an explained reading
        self._settings = settings
        self._heading = heading
        self._resampling = [stream(seed, "estimation.resampling", body) for body in bodies]
        self._roughening = [stream(seed, "estimation.roughening", body) for body in bodies]
        self._unexplained = np.zeros(len(bodies), int)  # readings in a row
        self._weights = np.zeros((len(bodies), 0))
        self.particles: Array | None = None  # (B, n, d) after resampling; None before the first reading

    def start(self, particles: Array) -> Posterior:
        """Starts from equally weighted particles (B, n, d)."""
        self._weights = np.full(particles.shape[:2], 1.0 / particles.shape[1])
        return self._conclude(particles, np.zeros(len(particles), bool))

    def correct(
        self, predicted: Array, errors: Array, respawn: Callable[[int], Array], new: Sequence[int] = ()
    ) -> Posterior:
        """Weighs predicted particles (B, n, d) by errors z - x of C channels, (C, B, n).

        A reading is unexplained where the mean of p(z - x) under the belief falls below the floor in any channel.
        After `patience` of them in a row body b starts again from respawn(b), (n, d). So do those that are `new`.
        """
        densities = np.empty(errors.shape)
        for density, error, model in zip(densities, errors, self._likelihoods, strict=True):
            density[:] = model.density(error)
        self._weights, expected = reweigh(self._weights, densities)
        self._unexplained = (self._unexplained + 1) * (expected < self._least).any(axis=0)
        recovered = self._unexplained >= self._settings.patience
        recovered[list(new)] = False
        started = [*np.flatnonzero(recovered).tolist(), *new]
        if started:
            predicted = predicted.copy()
            for body in started:
                predicted[body] = respawn(body)
                self._weights[body] = 1.0 / predicted.shape[1]
                self._unexplained[body] = 0
        return self._conclude(predicted, recovered)

    def coast(self, predicted: Array) -> Posterior:
        """Goes on with predicted particles (B, n, d) where nothing was measured."""
        return self._conclude(predicted, np.zeros(len(predicted), bool))

    def _conclude(self, particles: Array, recovered: NDArray[np.bool_]) -> Posterior:
        """The posterior by the weights; what to predict from is resampled where they have become uneven."""
        weights, num, strength = self._weights, particles.shape[1], self._settings.roughening
        offsets = [rng.random() for rng in self._resampling]  # one a reading, used or not, so that seeds stay paired
        mean, covariance = weighted_moments(particles, weights, self._heading)
        size = ess(weights)
        uneven = np.flatnonzero(size < self._settings.resample_below * num).tolist()
        self.particles = particles
        if uneven:
            self.particles, self._weights = particles.copy(), weights.copy()
            for body in uneven:
                normal = self._roughening[body].standard_normal(particles.shape[1:])
                self.particles[body] = resample(
                    particles[body], weights[body], offsets[body], covariance[body], strength, normal
                )
                self._weights[body] = 1.0 / num
        return Posterior(particles, weights, mean, covariance, size, recovered)


# ------------------------------------------------------------------------------------ robot's pose


POSE_CHANNELS = ("pose.x", "pose.y", "pose.theta")
ODOMETRY_CHANNELS = ("odometry.v", "odometry.omega")


class ParticleLocalizer(PoseEstimator):
    """Monte Carlo localisation (Thrun, Burgard & Fox 2005, table 8.2) with the noise as it is, not a Gaussian.

    Predict: (v, omega)_i = odometry - noise draw, through the unicycle over the reading's interval.
    Correct: w_i <- w_i prod_c [(1 - epsilon) p_c(z_c - x_i,c) + floor] over x, y and the heading (wrapped).
    Start: measurement - noise draws of the first reading, so the filter need not trust where the robot was put.
    """

    def __init__(
        self,
        noise: Mapping[str, Distribution],
        num_particles: int,
        seed: int,
        settings: FilterSettings | None = None,
    ):
        super().__init__(seed)
        settings = settings or FilterSettings()
        self._num = num_particles
        self._odometry = [widened(channel, noise[channel]) for channel in ODOMETRY_CHANNELS]
        self._likelihoods = [Likelihood.of(channel, noise[channel], settings.epsilon) for channel in POSE_CHANNELS]
        self._motion_streams = [stream(seed, f"estimation.motion.{channel}") for channel in ODOMETRY_CHANNELS]
        self._start_stream = stream(seed, "estimation.start")
        self._filter = Bootstrap(("robot",), self._likelihoods, seed, settings, heading=HEADING)

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading; its moments come from the weights before resampling.

        Without a pose in it the odometry alone goes on.
        """
        if self._filter.particles is None:
            posterior = self._filter.start(self._spawn(reading)[None])
        else:
            predicted = moved(self._filter.particles[0], reading, self._odometry, self._motion_streams)
            if "pose" in reading.dropped:
                posterior = self._filter.coast(predicted[None])
            else:
                errors = pose_errors(reading.pose, predicted)[:, None]
                posterior = self._filter.correct(predicted[None], errors, lambda _: self._spawn(reading))
        (particles,), (weights,), (mean,), (covariance,), (size,), (recovered,) = posterior
        self._belief = RobotBelief(reading.time, particles, weights, mean, covariance, float(size), bool(recovered))
        return self._belief

    def _spawn(self, reading: Reading) -> Array:
        """Poses that the reading alone allows: measurement - noise draws, (n, 3)."""
        return pose_samples(reading, [model.noise for model in self._likelihoods], self._num, self._start_stream)


@kernel
def pose_errors(measured: Vector, poses: Matrix):
    """Measurement (3,) - poses (n, 3), one row a component, (3, n); the heading's is wrapped."""
    errors = np.empty((3, len(poses)))
    for i in range(len(poses)):
        errors[0, i] = measured[0] - poses[i, 0]
        errors[1, i] = measured[1] - poses[i, 1]
        errors[2, i] = wrapped(measured[2] - poses[i, 2])
    return errors


def moved(
    particles: Array, reading: Reading, noise: Sequence[Distribution], streams: Sequence[np.random.Generator]
) -> Array:
    """Particles (n, 3) moved by what the odometry measured less a noise draw each, from a stream a channel.

    Where the odometry is silent they go on as it said last, each with a change of its own.
    """
    num = len(particles)
    twist = reading.odometry[:, None] - [channel.sample(rng, num) for channel, rng in zip(noise, streams, strict=True)]
    if "odometry" in reading.dropped:
        for values, std, rng in zip(twist, UNKNOWN_TWIST_STD, streams, strict=True):
            values += std * rng.standard_normal(num)
    return integrate_rows(particles, twist[0], twist[1], reading.interval)


def pose_samples(reading: Reading, noise: list[Distribution], num: int, rng: np.random.Generator) -> Array:
    """Measurement - noise draws, (num, 3), headings in (-pi, pi]."""
    samples = reading.pose - np.stack([channel.sample(rng, num) for channel in noise], axis=-1)
    samples[:, HEADING] = wrap(samples[:, HEADING])
    return samples


# --------------------------------------------------------------------------------------- people


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

    def predict(self, state: Array, interval: float, uniform: Array, normal: Array) -> Array:
        """States (P, n, 4) after `interval` [s], by draws uniform (P, n) of U(0, 1) and normal (P, n, 2) of N(0, 1)."""
        q = self.turn_probability(interval)
        sway, stops = self.sway * sqrt(interval), q * self.stop_share
        return _walked(state, uniform, normal, interval, sway, self.walking_speed, q, stops)

    def variances(self, interval: float) -> tuple[float, float]:
        """Of the changes of a velocity's and a position's component within `interval` [s], by one Gaussian.

        The mixture's for a person whose own velocity is N(0, walking_speed^2 I):
        (1 - q) sway^2 T + q (2 - stop_share) walking_speed^2, and 0.
        """
        q = self.turn_probability(interval)
        return (1.0 - q) * self.sway**2 * interval + q * (2.0 - self.stop_share) * self.walking_speed**2, 0.0


@kernel
def _walked(
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


DETECTION_CHANNELS = ("detection.x", "detection.y")


class ParticleTracker(PeopleTracker):
    """Tracks people whose detections come with their identity.

    Predict: `PersonMotion`. Correct: w_i <- w_i prod_c [(1 - epsilon) p_c(z_c - x_i,c) + floor] over x and y.
    Start, again for who was away: position = detection - noise draws, velocity ~ N(0, walking_speed^2). All people are
    computed at once, each from streams of its own, so that one person's track does not depend on how many others there
    are.
    """

    def __init__(
        self,
        noise: Mapping[str, Distribution],
        num_particles: int,
        radii: Sequence[float],
        seed: int,
        settings: FilterSettings | None = None,
        motion: PersonMotion | None = None,
    ):
        super().__init__(radii, seed)
        settings = settings or FilterSettings()
        self._num = num_particles
        self._motion = motion or PersonMotion()
        self._likelihoods = [Likelihood.of(channel, noise[channel], settings.epsilon) for channel in DETECTION_CHANNELS]
        self._motion_streams = [stream(seed, "estimation.motion", name) for name in self._names]
        self._start_streams = [stream(seed, "estimation.start", name) for name in self._names]
        self._filter = Bootstrap(self._names, self._likelihoods, seed, settings)

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, after one more reading; their moments come from the weights before
        resampling.
        """
        if not self._names:
            self._tracks = ()
            return ()
        tracked = self._detected(reading)
        # The filters of people who are not there go on, with a detection where they believe to be: nobody asks them.
        new = [p for p in tracked if p not in self._tracked]
        if self._filter.particles is None:
            posterior = self._filter.start(np.stack([self._spawn(p, reading) for p in range(len(self._names))]))
        else:
            predicted = self._predict(self._filter.particles, reading.interval)
            if "detections" in reading.dropped:
                posterior = self._filter.coast(predicted)
            else:
                errors = np.subtract(reading.detections.T[:, :, None], predicted.transpose(2, 0, 1)[:2], order="C")
                errors[np.isnan(errors)] = 0.0
                posterior = self._filter.correct(predicted, errors, lambda p: self._spawn(p, reading), new)
        return self._conclude(reading.time, posterior, tracked)

    def _predict(self, particles: Array, interval: float) -> Array:
        """Particles (P, n, 4) after `interval` [s]."""
        draws = np.empty((len(self._names), 3, self._num))
        for rng, row in zip(self._motion_streams, draws, strict=True):
            rng.random(out=row[0])
            rng.standard_normal(out=row[1:])
        uniform, normal = draws[:, 0].copy(), np.swapaxes(draws[:, 1:], 1, 2).copy()
        return self._motion.predict(particles, interval, uniform, normal)

    def _spawn(self, person: int, reading: Reading) -> Array:
        """States that one detection alone allows, (n, 4)."""
        rng = self._start_streams[person]
        position = detection_samples(
            np.nan_to_num(reading.detections[person]), [model.noise for model in self._likelihoods], self._num, rng
        )
        return np.hstack([position, self._motion.walking_speed * rng.standard_normal((self._num, 2))])


def detection_samples(detection: Array, noise: Sequence[Distribution], num: int, rng: np.random.Generator) -> Array:
    """Detection - noise draws, (num, 2)."""
    return detection - np.stack([channel.sample(rng, num) for channel in noise], axis=-1)
