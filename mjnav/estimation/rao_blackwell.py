"""People's positions and velocities by one Rao-Blackwellised particle filter a person, detected with identity."""

from collections.abc import Mapping, Sequence

import numpy as np

from mjnav.estimation.base import PeopleTracker
from mjnav.estimation.likelihood import FLOOR_WIDTH, LEAST_STD, widened
from mjnav.estimation.stop_and_go import StopAndGo
from mjnav.estimation.tracker import DETECTION_CHANNELS
from mjnav.estimation.walk_filter import WalkFilter
from mjnav.filters.gaussian_sum import GaussianSum, fitted
from mjnav.messages import Reading, RobotBelief, Track
from mjnav.noise import Distribution
from mjnav.rng import stream

COMPONENTS = 3  # Gaussians in place of the noise of one channel
DRAWS = 4000  # of the noise, to which they are fitted
OUTLIERS = 0.01  # share of detections that the noise may fail to explain
FLOOR = OUTLIERS / (FLOOR_WIDTH["detection.x"] * FLOOR_WIDTH["detection.y"])  # [1/m^2] their density
MOTION = StopAndGo(sway=0.1)  # errors of 12 cm hide a curve: more sway would only make velocities tremble
PATIENCE = 3  # unexplained detections in a row after which a person is looked for anew


class RaoBlackwellTracker(PeopleTracker):
    """Tracks people whose detections come with their identity, by `WalkFilter`.

    The noise of each channel is taken for a sum of Gaussians, so that its skew counts; what a sum cannot show is a hard
    edge. A detection is unexplained where its density falls below twice the floor's. Each person's filter and particles
    have streams of their own, so that one track does not depend on how many people there are.
    """

    def __init__(self, noise: Mapping[str, Distribution], num_particles: int, radii: Sequence[float], seed: int):
        super().__init__(radii, seed)
        self._num, self._noise = num_particles, detection_noise(noise)
        self._filters = [
            WalkFilter(num_particles, stream(seed, "estimation.resampling", name), MOTION) for name in self._names
        ]
        self._streams = [stream(seed, "estimation.particles", name) for name in self._names]
        self._unexplained = [0] * len(self._names)  # detections in a row
        self._started = False
        self._weights = np.full(num_particles, 1.0 / num_particles)

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person who is there, after one more reading."""
        there, arrived = self._detected(reading), "detections" not in reading.dropped
        recovered = np.zeros(len(self._names), bool)
        for p, walk in enumerate(self._filters):
            measured = np.nan_to_num(reading.detections[p])
            known = self._started and p in self._tracked  # the track of who was away begins anew
            if known and p in there:
                walk.predict(reading.interval)
                recovered[p] = arrived and self._loses(p, walk.correct(measured, self._noise, floor=FLOOR))
            if recovered[p] or not known:
                walk.start(measured, self._noise)
                self._unexplained[p] = 0
        self._started = True
        num = len(self._names)
        return self._conclude(
            reading.time,
            [walk.draw(self._num, rng) for walk, rng in zip(self._filters, self._streams, strict=True)],
            [self._weights] * num,
            [walk.mean for walk in self._filters],
            [walk.covariance for walk in self._filters],
            [self._num] * num,
            recovered,
            there,
        )

    def _loses(self, person: int, density: float) -> bool:
        """Whether a filter explains its person's detections no more, after one more of that density [1/m^2]."""
        self._unexplained[person] = 0 if density >= 2.0 * FLOOR else self._unexplained[person] + 1
        return self._unexplained[person] >= PATIENCE


def detection_noise(noise: Mapping[str, Distribution]) -> GaussianSum:
    """The noise of a detection in the plane as a sum of Gaussians, fitted to draws that are always the same."""
    x, y = (_axis(channel, widened(channel, noise[channel])) for channel in DETECTION_CHANNELS)
    return x.beside(y)


def _axis(channel: str, noise: Distribution) -> GaussianSum:
    """The noise of one channel, in one dimension; the draws are brought to its own mean and std."""
    draws = noise.sample(stream(0, "estimation.fit", channel), DRAWS)
    draws = noise.mean + (draws - draws.mean()) * noise.std / max(draws.std(), 1e-12)
    return fitted(draws, COMPONENTS, LEAST_STD[channel])
