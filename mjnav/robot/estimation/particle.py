"""Bootstrap particle filter of the robot's pose, for readings with noise.

    predict    x_i drawn from the motion: odometry less draws of its noise
    correct    w_i <- w_i prod_c [(1 - epsilon) p_c(z_c - x_i,c) + floor]   (Gordon, Salmond & Smith 1993)
    resample   systematically, where the effective sample size is low, and roughened
    recover    from the reading alone, where the belief explains the readings no more

The noise counts as it is and is not taken for a Gaussian.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mjnav.compile.compiled import Indices, Matrix, Vector, kernel
from mjnav.filters.particles import ess, resample, reweigh, systematic, weighted_moments
from mjnav.geometry.angles import wrap, wrapped
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.motion.unicycle import integrate_rows
from mjnav.noise import Distribution
from mjnav.noise.correlated import Copula
from mjnav.rng import stream
from mjnav.robot.estimation import base

POSE_CHANNELS = ("pose.x", "pose.y", "pose.theta")
ODOMETRY_CHANNELS = ("odometry.v", "odometry.omega")
Laws = Mapping[str, Distribution]  # by channel
Times = Mapping[str, float]
INDEPENDENT: Times = MappingProxyType({})

EPSILON = 0.01  # weight of the likelihood's floor: the share of readings that the noise model may fail to explain
RESAMPLE_BELOW = 0.5  # of the particles, an effective sample size (1/2 is customary)
ROUGHENING = 1.5  # K of `filters.particles.roughen`: 4 % of variance; with 0.5 the 95 % regions held less than 90 %
PATIENCE = 3  # unexplained readings in a row: a single one is more often an outlier than a lost robot


class ParticleLocalizer(base.PoseEstimator):
    """Monte Carlo localisation (Thrun, Burgard & Fox 2005, table 8.2) with the noise as it is, not a Gaussian.

    Predict: (v, omega)_i = odometry - noise draw, through the unicycle over the reading's interval.
    Correct: w_i <- w_i prod_c [(1 - epsilon) p_c(z_c - x_i,c) + floor] over x, y and the heading (wrapped).
    Where the errors of a channel last, a particle knows its own: e_k = z - x of the pose is weighed by p_c(e_k | e_k-1)
    in place of p_c(e_k), and its odometry errs next by what follows from its error before.
    Start: measurement - noise draws of the first reading, so the filter need not trust where the robot was put. It
    starts again after PATIENCE readings in a row that are unexplained: the mean of p_c(z_c - x) under the belief is
    below the floor in a channel.
    """

    def __init__(self, noise: Laws, num_particles: int, seed: int, lasting: Times = INDEPENDENT):
        """`lasting` has correlation times [s]; the errors of other channels are independent."""
        super().__init__(seed)
        self._num = num_particles
        odometry = {channel: base.widened(channel, noise[channel]) for channel in ODOMETRY_CHANNELS}
        self._drifts = {c: Drift(Copula.of(law, lasting[c])) for c, law in odometry.items() if c in lasting}
        self._odometry = [self._drifts.get(channel, law) for channel, law in odometry.items()]
        self._likelihoods = [base.Likelihood.of(channel, noise[channel], EPSILON) for channel in POSE_CHANNELS]
        rows = [(row, channel) for row, channel in enumerate(POSE_CHANNELS) if channel in lasting]
        self._lasting = [(row, Copula.of(self._likelihoods[row].noise, lasting[channel])) for row, channel in rows]
        self._errors, self._seen = np.zeros((3, num_particles)), 0.0  # of the latest pose reading, and its time [s]
        self._least = np.array([2.0 * model.floor for model in self._likelihoods])  # density of an explained reading
        self._motion_streams = [stream(seed, f"estimation.motion.{channel}") for channel in ODOMETRY_CHANNELS]
        self._start_stream = stream(seed, "estimation.start")
        self._resampling = stream(seed, "estimation.resampling", "robot")
        self._roughening = stream(seed, "estimation.roughening", "robot")
        self._unexplained = 0  # readings in a row
        self._particles: Array | None = None  # (n, 3) to predict from; None before the first reading
        self._weights = np.zeros(0)

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading; its moments come from the weights before resampling.

        Without a pose in it the odometry alone goes on.
        """
        recovered = False
        if self._particles is None:
            particles = self._started(reading)
        else:
            particles = self._moved(self._particles, reading)
            if "pose" not in reading.dropped:
                recovered = self._correct(particles, reading)
                particles = self._started(reading) if recovered else particles
        mean, covariance = weighted_moments(particles, self._weights, base.HEADING)
        size, weights = ess(self._weights), self._weights
        offset = self._resampling.random()  # one a reading, used or not, so that seeds stay paired
        self._particles = particles
        if size < RESAMPLE_BELOW * self._num:
            normal = self._roughening.standard_normal(particles.shape)
            self._particles = resample(particles, weights, offset, covariance, ROUGHENING, normal)
            self._weights = np.full(self._num, 1.0 / self._num)
            if self._drifts:
                drawn = systematic(weights, offset, self._num)
                for drift in self._drifts.values():
                    drift.choose(drawn)
        if self._lasting and "pose" not in reading.dropped:
            self._errors, self._seen = pose_errors(reading.pose, self._particles), reading.time
        self._belief = RobotBelief(reading.time, particles, weights, mean, covariance, size, recovered)
        return self._belief

    def _moved(self, particles: Array, reading: Reading) -> Array:
        """Particles (n, 3) after what the odometry of a reading says."""
        for drift in self._drifts.values():
            drift.interval = reading.interval
        return moved(particles, reading, self._odometry, self._motion_streams)

    def _correct(self, particles: Array, reading: Reading) -> bool:
        """Weighs predicted particles (n, 3) by a pose; whether they have explained too many in a row no more."""
        errors = pose_errors(reading.pose, particles)
        densities = np.empty(errors.shape)
        for row, model in enumerate(self._likelihoods):
            densities[row] = model.density(errors[row])
        interval = reading.time - self._seen
        for row, copula in self._lasting if interval > 0.0 else ():
            floor = self._likelihoods[row].floor
            densities[row] = floor + (densities[row] - floor) * copula.news(errors[row], self._errors[row], interval)
        self._weights, expected = reweigh(self._weights, densities)
        self._unexplained = self._unexplained + 1 if (expected < self._least).any() else 0
        return self._unexplained >= PATIENCE

    def _started(self, reading: Reading) -> Array:
        """Equally weighted poses that the reading alone allows, (n, 3)."""
        self._weights, self._unexplained = np.full(self._num, 1.0 / self._num), 0
        return pose_samples(reading, [model.noise for model in self._likelihoods], self._num, self._start_stream)


class Drift:
    """Odometry errors that last: each of n particles has its own, which goes on from the one before."""

    def __init__(self, copula: Copula):
        self._copula, self.interval = copula, 0.0  # [s] after which the next are drawn
        self._scores: Array | None = None  # (n,)

    def sample(self, rng: np.random.Generator, num: int) -> Array:
        """The next errors (num,)."""
        normal, before = rng.standard_normal(num), self._scores
        self._scores = normal if before is None else self._copula.following(before, self.interval, normal)
        return self._copula.values(self._scores)

    def choose(self, indices: Indices) -> None:
        """Goes on with those of the particles that were drawn."""
        self._scores = None if self._scores is None else self._scores[indices]


SLIDE = 0.3  # [s]; times the centripetal acceleration: how quickly a robot that skids slides sideways


class SkiddingLocalizer(ParticleLocalizer):
    """Of a robot that skids in turns, whose wheels do not say how it turns.

    Its turn rate is the gyro's, and it slides across its heading by draws from N(0, (SLIDE v omega)^2) [m/s].
    """

    def __init__(self, noise: Laws, num_particles: int, seed: int, lasting: Times = INDEPENDENT):
        lasting = {channel: tau for channel, tau in lasting.items() if channel != "odometry.omega"}
        if "gyro" in lasting:
            lasting["odometry.omega"] = lasting["gyro"]
        super().__init__({**noise, "odometry.omega": noise["gyro"]}, num_particles, seed, lasting)
        self._slide_stream = stream(seed, "estimation.motion.slide")

    def _moved(self, particles: Array, reading: Reading) -> Array:
        v, omega = float(reading.odometry[0]), reading.gyro
        dropped = (*reading.dropped, *["odometry"] * ("gyro" in reading.dropped))
        found = super()._moved(particles, replace(reading, odometry=np.array([v, omega]), dropped=dropped))
        slid = SLIDE * v * omega * reading.interval * self._slide_stream.standard_normal(len(found))
        found[:, 0] -= slid * np.sin(found[:, base.HEADING])
        found[:, 1] += slid * np.cos(found[:, base.HEADING])
        return found


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
    particles: Array, reading: Reading, noise: Sequence[Distribution | Drift], streams: Sequence[np.random.Generator]
) -> Array:
    """Particles (n, 3) moved by what the odometry measured less a noise draw each, from a stream a channel.

    Where the odometry is silent they go on as it said last, each with a change of its own.
    """
    num = len(particles)
    twist = reading.odometry[:, None] - [channel.sample(rng, num) for channel, rng in zip(noise, streams, strict=True)]
    if "odometry" in reading.dropped:
        for values, std, rng in zip(twist, base.UNKNOWN_TWIST_STD, streams, strict=True):
            values += std * rng.standard_normal(num)
    return integrate_rows(particles, twist[0], twist[1], reading.interval)


def pose_samples(reading: Reading, noise: list[Distribution], num: int, rng: np.random.Generator) -> Array:
    """Measurement - noise draws, (num, 3), headings in (-pi, pi]."""
    samples = reading.pose - np.stack([channel.sample(rng, num) for channel in noise], axis=-1)
    samples[:, base.HEADING] = wrap(samples[:, base.HEADING])
    return samples
