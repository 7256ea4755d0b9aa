"""Interfaces of the estimators and what they share: assumed noise, likelihoods of channels, samples of beliefs.

A filter assumes the noise of the world or of another profile, but no standard deviation below the least of its channel.
The likelihood of a channel has a floor.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Protocol

import numpy as np

from mjnav.compile.compiled import Vector, kernel
from mjnav.constant import Constant
from mjnav.filters.particles import ess, shuffled, weighted_moments
from mjnav.messages import Array, Detection, Reading, RobotBelief, Track, finite
from mjnav.noise import Distribution, make_distribution, profile
from mjnav.rng import stream
from mjnav.scene.spec import Scenario

# ------------------------------------------------------------------------------------ assumed noise


def assumed_noise(scenario: Scenario) -> Mapping[str, Distribution]:
    """The noise that the estimators assume: the world's, unless `assumed_profile` names another."""
    assumed = scenario.estimation.assumed_profile
    return scenario.noise.distributions() if assumed is None else profile(assumed)


def assumed_correlation_times(scenario: Scenario) -> Mapping[str, float]:
    """The same of how long errors last [s], by channel; under `assumed_profile` none do."""
    return scenario.noise.correlation_time if scenario.estimation.assumed_profile is None else {}


# -------------------------------------------------------------------------- likelihood of a channel


DETECTION_CHANNELS = ("detection.x", "detection.y")

# Least standard deviations. A channel without noise would ask of a particle what no finite number of them can meet.
LEAST_STD = {
    "pose.x": 1e-3,  # [m]
    "pose.y": 1e-3,  # [m]
    "pose.theta": 1e-3,  # [rad]
    "detection.x": 1e-2,  # [m]: people's velocity is uncertain by 0.1 m/s and more, 1 cm within a period of 0.1 s
    "detection.y": 1e-2,  # [m]
    "odometry.v": 5e-3,  # [m/s]: to which wheels track on the floor
    "odometry.omega": 5e-3,  # [rad/s]
    "gyro": 2e-3,  # [rad/s]: the integral of the yaw rate is exact, its time and the scan's are not
}

# Width of the floor's uniform density: a room, a full turn.
FLOOR_WIDTH = {
    "pose.x": 10.0,  # [m]
    "pose.y": 10.0,  # [m]
    "pose.theta": 2.0 * np.pi,  # [rad]
    "detection.x": 10.0,  # [m]
    "detection.y": 10.0,  # [m]
}

MAX_LOG_DENSITY = 30.0  # of an edge where a density is infinite; it keeps the weights finite


def widened(channel: str, noise: Distribution) -> Distribution:
    """The channel's noise, or a Gaussian of its mean and the least std where it is narrower than that."""
    least = LEAST_STD[channel]
    return make_distribution("gaussian", mean=noise.mean, std=least) if noise.std < least else noise


# Of the table in place of a density.
CELLS = 128  # a standard deviation
REACH = 64  # standard deviations to each side of the mean
NEGLIGIBLE = 1e-4  # of the floor: what the density may still be where the table ends


@dataclass(frozen=True, slots=True)
class Likelihood(Constant):
    """p(z | x) = (1 - epsilon) p(z - x) + epsilon / width, p the density of the noise with its mean.

    A reading is truth plus noise, so the noise that a particle implies is z - x. The floor is constant everywhere,
    also beyond its width: several noises have bounded support, and no reading may kill every particle.
    """

    noise: Distribution
    epsilon: float
    width: float
    _table: "tuple[float, float, Array] | None" = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        object.__setattr__(self, "_table", self._tabulate())

    @classmethod
    @lru_cache(maxsize=64)  # episodes of a sweep, and of an environment, have the same noise
    def of(cls, channel: str, noise: Distribution, epsilon: float) -> "Likelihood":
        """The likelihood of a channel, its noise widened where it has nearly none."""
        return cls(widened(channel, noise), epsilon, FLOOR_WIDTH[channel])

    @property
    def floor(self) -> float:
        """The floor's density."""
        return self.epsilon / self.width

    def density(self, error: Array) -> Array:
        """p(z | x) for errors z - x of any shape; never below the floor, never infinite.

        Interpolated in a table where one is fine enough: the result lies between `exact_density` at the two ends of a
        cell of 1/128 standard deviation, so an edge is blurred by no more than that; the relative error over
        the shipped noises averages 1e-5 to 1e-4. Computed exactly are infinite peaks, spikes, tails without end.
        """
        if self._table is None:
            return self.exact_density(error)
        error = np.asarray(error, float)
        return _interpolated(error.reshape(-1), *self._table, self.floor).reshape(error.shape)

    def exact_density(self, error: Array) -> Array:
        """`density` without a table."""
        density = np.exp(np.minimum(self.noise.logpdf(error), MAX_LOG_DENSITY))
        return (1.0 - self.epsilon) * density + self.floor

    def _tabulate(self) -> "tuple[float, float, Array] | None":
        """The first error of the table, cells a unit and `exact_density` at the cells' ends; None if too coarse."""
        scale = CELLS / self.noise.std
        error = self.noise.mean + np.arange(-CELLS * REACH, CELLS * REACH + 1) / scale
        values = self.exact_density(error)
        seen = np.flatnonzero(values > self.floor * (1.0 + NEGLIGIBLE))
        whole = (values - self.floor).sum() / scale / (1.0 - self.epsilon)
        if not (seen.size and 0.99 < whole < 1.01) or seen[0] == 0 or seen[-1] == values.size - 1:
            return None
        return float(error[seen[0] - 1]), float(scale), values[seen[0] - 1 : seen[-1] + 2].copy()


@kernel
def _interpolated(error: Vector, first: float, scale: float, values: Vector, outside: float):
    """Linear interpolation at errors (n,) in values at first, first + 1/scale, ...; (n,)."""
    found = np.full(len(error), outside)
    for i in range(len(error)):
        place = (error[i] - first) * scale
        if 0.0 <= place < len(values) - 1:
            cell = int(place)
            found[i] = values[cell] + (place - cell) * (values[cell + 1] - values[cell])
    return found


# ---------------------------------------------------------------------- interfaces and shared parts


WALKING_SPEED = 1.0  # [m/s] std of a velocity component of which nothing is known; people walk at 1 to 1.5 m/s
DRAWS = "estimation.draw"  # channel of the draws from beliefs
HEADING = 2  # column of the heading in a pose
# Std of the changes of v [m/s] and omega [rad/s] while odometry is silent: about a third of what such a robot drives.
UNKNOWN_TWIST_STD = (0.3, 0.5)


class Localizer(Protocol):
    """Estimates the robot's pose."""

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading; the first reading starts it."""
        ...

    def draw(self, num: int) -> Array:
        """Samples of the latest belief, (num, 3), in random order."""
        ...


class Tracker(Protocol):
    """Estimates position and velocity of every person."""

    @property
    def detections(self) -> tuple[Detection, ...]:
        """What the latest scan showed; empty for a tracker that does not detect by itself."""
        ...

    def update(self, reading: Reading, robot: RobotBelief | None = None) -> tuple[Track, ...]:
        """One track for each person, after one more reading.

        Where detections come with identity: of each person who is detected, in the order of the detections. The first
        detection starts a track; one that is NaN, of somebody who is not there, ends it. A tracker that goes by scans
        needs the `robot`'s belief after the same reading.
        """
        ...

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order, persons independent of one another."""
        ...


NO_BELIEF = "draw() needs a belief: call update() with a reading first"


def error_at(away: Array) -> Array:
    """(3, 3), which takes a small error of a pose to the error of its frame `away` (2,) [m] from it, in world axes."""
    x, y = away.tolist()
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])


class PoseEstimator:
    """What all localizers share: the latest belief and the draws from it."""

    def __init__(self, seed: int):
        self._drawing = stream(seed, DRAWS, "robot")
        self._belief: RobotBelief | None = None

    def draw(self, num: int) -> Array:
        """Samples of the latest belief, (num, 3), in random order; an error before the first reading."""
        if self._belief is None:
            raise RuntimeError(NO_BELIEF)
        return shuffled(self._belief.particles, self._belief.weights, num, self._drawing)


def robot_belief(time: float, particles: Array, weights: Array | None = None) -> RobotBelief:
    """A belief of the robot's pose at `time` [s] from particles (n, 3) and weights (n,), equal ones by default.

    Raises InvalidValue for anything else.
    """
    return RobotBelief(time, *_moments(particles, weights, HEADING))


def person_track(name: str, time: float, radius: float, particles: Array, weights: Array | None = None) -> Track:
    """The same of a person's state, from particles (n, 4), under a name and with a radius [m]."""
    return Track(name, time, *_moments(particles, weights, -1), radius)


def _moments(particles: Array, weights: Array | None, heading: int) -> tuple[Array, Array, Array, Array, float]:
    particles = np.ascontiguousarray(finite("particles", particles, None, 3 if heading == HEADING else 4))
    num = len(particles)
    weights = np.full(num, 1.0 / num) if weights is None else finite("weights", weights, num)
    mean, covariance = weighted_moments(particles, weights, heading)
    return particles, weights, mean, covariance, ess(weights)


def person_names(num_people: int) -> tuple[str, ...]:
    """Names of the people, in the order of the readings' detections."""
    return tuple(f"person{i}" for i in range(num_people))


class PeopleTracker:
    """What all trackers share: the people's names and radii, the latest tracks and the draws from them."""

    def __init__(self, radii: Sequence[float], seed: int):
        self._radii = tuple(radii)
        self._names = person_names(len(self._radii))
        self._drawing = [stream(seed, DRAWS, name) for name in self._names]
        self._tracks: tuple[Track, ...] | None = None
        self._tracked = range(len(self._names))  # whose they are
        self._everybody = self._tracked

    @property
    def detections(self) -> tuple[Detection, ...]:
        """None: they come with the reading."""
        return ()

    def _detected(self, reading: Reading) -> Sequence[int]:
        """Who is there, by place; where no detections arrived, who was before. Radii that the reading tells hold."""
        if reading.people_radius is not None:
            self._radii = tuple(reading.people_radius.tolist())
        if "detections" in reading.dropped and self._tracks is not None:
            return self._tracked
        absent = np.isnan(reading.detections[:, 0])
        return np.flatnonzero(~absent).tolist() if absent.any() else self._everybody

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order; an error before the first reading."""
        if self._tracks is None:
            raise RuntimeError(NO_BELIEF)
        pairs = zip(self._tracked, self._tracks, strict=True)
        return tuple([shuffled(track.particles, track.weights, num, self._drawing[p]) for p, track in pairs])

    def _conclude(
        self,
        time: float,
        particles: Sequence[Array] | Array,
        weights: Array,
        mean: Sequence[Array],
        covariance: Sequence[Array],
        tracked: Sequence[int],
        recovered: Sequence[bool] = (),
    ) -> tuple[Track, ...]:
        """The latest tracks, of those who are `tracked`, from what is believed of all people.

        particles (B, n, 4), mean (B, 4), covariance (B, 4, 4); the weights (n,) are equal. `recovered` (B,): whose
        beliefs started again from the reading.
        """
        self._tracked, size = tracked, float(len(weights))
        names, radii = self._names, self._radii
        self._tracks = tuple([
            Track(
                names[p], time, particles[p], weights, mean[p], covariance[p], size, radii[p],
                bool(recovered) and recovered[p],
            )
            for p in tracked
        ])  # fmt: skip
        return self._tracks
