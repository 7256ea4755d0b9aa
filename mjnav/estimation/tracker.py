"""People's positions and velocities by one bootstrap particle filter a person on (x, y, vx, vy)."""

from collections.abc import Mapping, Sequence

import numpy as np

from mjnav.estimation.base import FilterSettings, Likelihood, PeopleTracker
from mjnav.estimation.bootstrap import Bootstrap
from mjnav.estimation.person_motion import PersonMotion
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.noise import Distribution
from mjnav.rng import stream

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
                p = self._filter.coast(predicted)
                return self._conclude(
                    reading.time, p.particles, p.weights, p.mean, p.covariance, p.ess, p.recovered, tracked
                )
            errors = np.subtract(reading.detections.T[:, :, None], predicted.transpose(2, 0, 1)[:2], order="C")
            errors[np.isnan(errors)] = 0.0
            posterior = self._filter.correct(predicted, errors, lambda p: self._spawn(p, reading), new)
        p = posterior
        return self._conclude(reading.time, p.particles, p.weights, p.mean, p.covariance, p.ess, p.recovered, tracked)

    def _predict(self, particles: Array, interval: float) -> Array:
        """Particles (P, n, 4) after `interval` [s]."""
        draws = np.empty((len(self._names), 3, self._num))
        for rng, row in zip(self._motion_streams, draws, strict=True):
            rng.random(out=row[0])
            rng.standard_normal(out=row[1:])
        return self._motion.predict(particles, interval, draws[:, 0], np.swapaxes(draws[:, 1:], 1, 2))

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
