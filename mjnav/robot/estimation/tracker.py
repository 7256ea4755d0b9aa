"""Trackers of people whose detections have identity, by a filter a person: of particles, or a Kalman filter."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np

from mjnav.filters.mixture_kalman import GaussianSum, fitted
from mjnav.messages import Reading, RobotBelief, Track
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.robot.estimation.base import DETECTION_CHANNELS, FLOOR_WIDTH, LEAST_STD, PeopleTracker, widened
from mjnav.robot.estimation.kalman import KalmanPersonFilter, noise_moments
from mjnav.robot.estimation.walk_filter import StopAndGo, WalkFilter

MOTION = StopAndGo(sway=0.1)  # errors of 12 cm hide a curve: more sway would only make velocities tremble
PersonFilter = WalkFilter | KalmanPersonFilter
PATIENCE = 3  # unexplained detections in a row after which a person is looked for anew


class FilteringTracker(PeopleTracker):
    """Tracks each person by a filter that takes detections for the truth plus a sum of Gaussians.

    A detection is unexplained where its density falls below twice `floor` [1/m^2]. Each person's filter and particles
    have streams of their own, so that one track does not depend on how many people there are.
    """

    def __init__(
        self,
        radii: Sequence[float],
        seed: int,
        make: Callable[[str], PersonFilter],
        noise: GaussianSum,
        num_particles: int,
        channel: str,
        floor: float = 0.0,
    ):
        """`make` makes a filter for a person of that name; `channel` names the streams of the particles."""
        super().__init__(radii, seed)
        self._num, self._noise, self._floor = num_particles, noise, floor
        self._filters = [make(name) for name in self._names]
        self._streams = [stream(seed, channel, name) for name in self._names]
        self._unexplained = [0] * len(self._names)  # detections in a row
        self._started = False
        self._weights = np.full(num_particles, 1.0 / num_particles)

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, after one more reading."""
        tracked, arrived = self._detected(reading), "detections" not in reading.dropped
        recovered = [False] * len(self._names)
        detections = np.where(np.isnan(reading.detections), 0.0, reading.detections)
        for p, (person, measured) in enumerate(zip(self._filters, detections, strict=True)):
            goes_on = self._started and p in self._tracked  # the track of who was away begins anew
            if goes_on and p in tracked:
                person.predict(reading.interval)
                if arrived:
                    recovered[p] = self._loses(p, person.correct(measured, self._noise, floor=self._floor))
            if recovered[p] or not goes_on:
                person.start(measured, self._noise)
                self._unexplained[p] = 0
        self._started = True
        particles = [person.draw(self._num, rng) for person, rng in zip(self._filters, self._streams, strict=True)]
        mean, covariance = [person.mean for person in self._filters], [person.covariance for person in self._filters]
        return self._conclude(reading.time, particles, self._weights, mean, covariance, tracked, recovered)

    def _loses(self, person: int, density: float) -> bool:
        """Whether a filter explains its person's detections no more, after one more of that density [1/m^2]."""
        self._unexplained[person] = 0 if density >= 2.0 * self._floor else self._unexplained[person] + 1
        return self._unexplained[person] >= PATIENCE


class KalmanTracker(FilteringTracker):
    """By a linear Kalman filter a person; every detection counts, however unlikely."""

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, radii: Sequence[float], seed: int):
        mean, covariance = noise_moments(noise, DETECTION_CHANNELS)
        error = GaussianSum(np.ones(1), mean[None], covariance[None])
        super().__init__(radii, seed, lambda _: KalmanPersonFilter(MOTION), error, num_particles, "estimation.gaussian")


HISTORIES = 50  # of a person at most: four times as many lower errors of predictions by 1 second by 0 to 2 %
COMPONENTS = 3  # Gaussians in place of the noise of one channel
DRAWS = 4000  # of the noise, to which they are fitted
OUTLIERS = 0.01  # share of detections that the noise may fail to explain
FLOOR = OUTLIERS / (FLOOR_WIDTH["detection.x"] * FLOOR_WIDTH["detection.y"])  # [1/m^2] their density


class ParticleTracker(FilteringTracker):
    """By a `WalkFilter` a person: particles are histories of walks, turns and stops.

    The noise of each channel is taken for a sum of Gaussians, so that its skew counts; what a sum cannot show is a hard
    edge. A track's particles are draws from the histories.
    """

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, radii: Sequence[float], seed: int):
        def make(name: str) -> WalkFilter:
            return WalkFilter(min(num_particles, HISTORIES), stream(seed, "estimation.resampling", name), MOTION)

        super().__init__(radii, seed, make, detection_noise(noise), num_particles, "estimation.particles", FLOOR)


def detection_noise(noise: Mapping[str, Distribution]) -> GaussianSum:
    """The noise of a detection in the plane as a sum of Gaussians, fitted to draws that are always the same."""
    x, y = (_axis(channel, widened(channel, noise[channel])) for channel in DETECTION_CHANNELS)
    return x.beside(y)


@lru_cache(maxsize=32)  # episodes of a sweep have the same noise
def _axis(channel: str, noise: Distribution) -> GaussianSum:
    """The noise of one channel, in one dimension; the draws are brought to its own mean and std."""
    draws = noise.sample(stream(0, "estimation.fit", channel), DRAWS)
    draws = noise.mean + (draws - draws.mean()) * noise.std / max(draws.std(), 1e-12)
    return _fitted(draws.tobytes(), LEAST_STD[channel])


@lru_cache(maxsize=32)  # one of a user's own is another object in each episode
def _fitted(draws: bytes, least_std: float) -> GaussianSum:
    return fitted(np.frombuffer(draws), COMPONENTS, least_std)
