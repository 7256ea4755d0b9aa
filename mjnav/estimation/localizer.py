"""The robot's pose by a bootstrap particle filter on (x, y, heading): odometry predicts, a pose sensor corrects."""

from collections.abc import Mapping, Sequence

import numpy as np

from mjnav.estimation.base import HEADING, UNKNOWN_TWIST_STD, FilterSettings, Likelihood, PoseEstimator, widened
from mjnav.estimation.bootstrap import Bootstrap
from mjnav.geometry.angles import wrap, wrapped
from mjnav.geometry.compiled import Matrix, Vector, kernel
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.motion.unicycle import integrate_rows
from mjnav.noise import Distribution
from mjnav.rng import stream

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
            predicted = self._predict(self._filter.particles[0], reading)
            if "pose" in reading.dropped:
                posterior = self._filter.coast(predicted[None])
            else:
                errors = pose_errors(reading.pose, predicted)[:, None]
                posterior = self._filter.correct(predicted[None], errors, lambda _: self._spawn(reading))
        self._belief = RobotBelief(
            time=reading.time,
            particles=posterior.particles[0],
            weights=posterior.weights[0],
            mean=posterior.mean[0],
            covariance=posterior.covariance[0],
            ess=float(posterior.ess[0]),
            recovered=bool(posterior.recovered[0]),
        )
        return self._belief

    def _predict(self, particles: Array, reading: Reading) -> Array:
        return moved(particles, reading, self._odometry, self._motion_streams)

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
    twist = [
        measured - channel.sample(rng, num)
        for measured, channel, rng in zip(reading.odometry, noise, streams, strict=True)
    ]
    if "odometry" in reading.dropped:
        for values, std, rng in zip(twist, UNKNOWN_TWIST_STD, streams, strict=True):
            values += std * rng.standard_normal(num)
    return integrate_rows(particles, twist[0], twist[1], reading.interval)


def pose_samples(reading: Reading, noise: list[Distribution], num: int, rng: np.random.Generator) -> Array:
    """Measurement - noise draws, (num, 3), headings in (-pi, pi]."""
    samples = reading.pose - np.stack([channel.sample(rng, num) for channel in noise], axis=-1)
    samples[:, HEADING] = wrap(samples[:, HEADING])
    return samples
