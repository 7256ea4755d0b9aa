"""Rao-Blackwellised particle filter of a person's position and velocity, and the tracker of one filter a person.

A particle is a history of walks, turns and stops; given that, position and velocity are Gaussian. The bootstrap filter
(`estimation.tracker`) draws positions and velocities, so it needs many changes of velocity among its particles to
follow one, and its mean velocity trembles. Here a particle holds the whole posterior of position and velocity under its
history, and only histories compete (Doucet, de Freitas, Murphy & Russell 2000).

The tracker gets detections with identity.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mjnav.estimation.base import FLOOR_WIDTH, LEAST_STD, PeopleTracker, widened
from mjnav.estimation.person_motion import STANDS, WALKS, StopAndGo, gone_on
from mjnav.estimation.tracker import DETECTION_CHANNELS
from mjnav.filters.mixture_kalman import GaussianSum, corrected, explained, fitted, kept, moments, sampled
from mjnav.filters.particles import systematic
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.noise import Distribution
from mjnav.rng import stream

# ----------------------------------------------------------------------------- filter of one person


class WalkFilter:
    """The belief about one person's x, y, vx, vy.

    Predict: `StopAndGo` lists the ways in which every particle may go on. Correct: `filters.mixture_kalman`, with the
    measurement's noise as a sum of Gaussians. Start: every component of that noise, with a walk and with a stand.
    """

    def __init__(self, num_particles: int, resampling: np.random.Generator, motion: StopAndGo | None = None):
        """`resampling` gives one number a step, whether it is used or not."""
        self._motion, self._num, self._resampling = motion or StopAndGo(), num_particles, resampling
        self._weights, self._walks = np.ones(0), np.ones(0, bool)
        self._mean, self._covariance = np.zeros((0, 4)), np.zeros((0, 4, 4))
        self._moments: tuple[Array, Array] | None = None

    def start(self, measured: Array, noise: GaussianSum) -> None:
        """Forgets all but a measured position (2,) [m]."""
        motion, num = self._motion, len(noise.weights)
        walks = np.repeat([WALKS, STANDS], num)
        mean, covariance = np.zeros((2 * num, 4)), np.zeros((2 * num, 4, 4))
        mean[:, :2] = measured - np.tile(noise.means, (2, 1))
        covariance[:, :2, :2] = np.tile(noise.covariances, (2, 1, 1))
        speed = np.where(walks, motion.walking_speed, motion.unrest)
        covariance[:, 2, 2] = covariance[:, 3, 3] = speed**2
        share = np.where(walks, motion.walking, 1.0 - motion.walking) * np.tile(noise.weights, 2)
        self._become(share, walks, mean, covariance)

    def predict(self, interval: float) -> None:
        """The belief after `interval` [s] of which nothing is known; one of no length changes nothing."""
        if interval <= 0.0:
            return
        chosen, weights = kept(self._weights, self._num, self._resampling.random())
        self._become(*gone_on(
            weights, self._walks[chosen], self._mean[chosen], self._covariance[chosen], interval, self._motion.rates,
        ))  # fmt: skip

    def correct(self, measured: Array, noise: GaussianSum, *, age: float = 0.0, floor: float = 0.0) -> float:
        """Conditions on the position (2,) [m] that was measured `age` [s] before; returns its density [1/m^2] before.

        `floor` [1/m^2] is the density of a measurement that says nothing, times its probability.
        """
        measured = np.ascontiguousarray(measured, float)
        terms = noise.weights, noise.means, noise.covariances
        joint = explained(self._weights, self._mean, self._covariance, measured, age, *terms, floor)
        density, offset = float(joint.sum()), self._resampling.random()
        if density > 0.0:
            chosen, weights = kept(joint, self._num, offset)
            owner, mean, covariance = corrected(chosen, self._mean, self._covariance, measured, age, *terms[1:])
            self._become(weights, self._walks[owner], mean, covariance)
        return density

    def density(self, measured: Array, noise: GaussianSum, *, age: float = 0.0) -> float:
        """Of a position (2,) [m] measured `age` [s] before, [1/m^2]."""
        terms = noise.weights, noise.means, noise.covariances
        measured = np.ascontiguousarray(measured, float)
        return float(explained(self._weights, self._mean, self._covariance, measured, age, *terms, 0.0).sum())

    def heaviest(self, most: int) -> tuple[NDArray[np.int64], Array]:
        """The places (k,) of the heaviest particles, k <= `most`, and two points of each, (2, k, 2) [m].

        They lie one std from the mean of its position to both sides, in the widest direction.
        """
        owner = np.argsort(-self._weights, kind="stable")[:most]
        values, axes = np.linalg.eigh(self._covariance[owner, :2, :2])
        offset = np.sqrt(np.maximum(values[:, 1:], 0.0)) * axes[:, :, 1]
        centre = self._mean[owner, :2]
        return owner, np.stack([centre - offset, centre + offset])

    def reweigh(self, owner: NDArray[np.int64], factors: Array) -> float:
        """Weighs particles `owner` (k,) by factors (k,) from [0, 1], the others by their mean, which is returned.

        Where it is zero nothing changes.
        """
        mean = float(self._weights[owner] @ factors / self._weights[owner].sum())
        if mean > 0.0:
            all_factors = np.full(len(self._weights), mean)
            all_factors[owner] = factors
            weights = self._weights * all_factors
            self._become(weights / weights.sum(), self._walks, self._mean, self._covariance)
        return mean

    @property
    def mean(self) -> Array:
        """(4,) of all particles together."""
        return self._all[0]

    @property
    def covariance(self) -> Array:
        """(4, 4) of all particles together."""
        return self._all[1]

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """Equally weighted states, (num, 4), as many of each particle as its weight says."""
        owner = systematic(self._weights, rng.random(), num)
        return sampled(owner, self._mean, self._covariance, rng.standard_normal((num, 4)))

    @property
    def _all(self) -> tuple[Array, Array]:
        found = self._moments or moments(self._weights, self._mean, self._covariance)
        self._moments = found
        return found

    def _become(self, weights: Array, walks: NDArray[np.bool_], mean: Array, covariance: Array) -> None:
        self._weights, self._walks, self._mean, self._covariance = weights, walks, mean, covariance
        self._moments = None


# ------------------------------------------------------------------------------------------ tracker


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
