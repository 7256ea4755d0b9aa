"""What the loop asks of an estimator, and what all estimators share."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mjnav.filters.resampling import shuffled
from mjnav.filters.weights import ess, weighted_moments
from mjnav.messages import Array, Detection, Reading, RobotBelief, Track, finite
from mjnav.rng import stream

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


@dataclass(frozen=True, slots=True)
class FilterSettings:
    """Parameters of a bootstrap particle filter.

    epsilon        weight of the likelihood's floor: the share of readings that the noise model may fail to explain
    resample_below resample where the effective sample size falls below this share of the particles (1/2 is customary)
    roughening     K of `filters.resampling.roughen`; 1.5 adds 4 % of variance at 500 particles in 3 dimensions, 16 % at
                   200 in 4. With 0.5 coverage of 95 % regions fell below 0.9 for the robot, 0.8 for people who stop
    patience       readings in a row that the belief does not explain before it is spread again: a single one is more
                   often an outlier than a lost robot
    """

    epsilon: float = 0.01
    resample_below: float = 0.5
    roughening: float = 1.5
    patience: int = 3


class BeliefDraws:
    """Draws from beliefs, one stream a body."""

    def __init__(self, bodies: Sequence[str], seed: int):
        self._streams = [stream(seed, DRAWS, body) for body in bodies]

    def __call__(self, body: int, belief: RobotBelief | Track | None, num: int) -> Array:
        """`num` of the belief's particles by weight, (num, d); an error before the first reading."""
        if belief is None:
            raise RuntimeError("draw() needs a belief: call update() with a reading first")
        return shuffled(belief.particles, belief.weights, num, self._streams[body])


class PoseEstimator:
    """What all localizers share: the latest belief and the draws from it."""

    def __init__(self, seed: int):
        self._draws = BeliefDraws(("robot",), seed)
        self._belief: RobotBelief | None = None

    def draw(self, num: int) -> Array:
        """Samples of the latest belief, (num, 3), in random order."""
        return self._draws(0, self._belief, num)


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
    (mean,), (covariance,) = weighted_moments(particles[None], weights[None], heading)
    return particles, weights, mean, covariance, float(ess(weights[None])[0])


def person_names(num_people: int) -> tuple[str, ...]:
    """Names of the people, in the order of the readings' detections."""
    return tuple(f"person{i}" for i in range(num_people))


class PeopleTracker:
    """What all trackers share: the people's names and radii, the latest tracks and the draws from them."""

    def __init__(self, radii: Sequence[float], seed: int):
        self._radii = tuple(radii)
        self._names = person_names(len(self._radii))
        self._draws = BeliefDraws(self._names, seed)
        self._tracks: tuple[Track, ...] | None = None
        self._tracked = range(len(self._names))  # whose they are
        self._everybody = self._tracked

    @property
    def detections(self) -> tuple[Detection, ...]:
        """None: they come with the reading."""
        return ()

    def _detected(self, reading: Reading) -> Sequence[int]:
        """Who is there, by place; where no detections arrived, who was before."""
        if "detections" in reading.dropped and self._tracks is not None:
            return self._tracked
        absent = np.isnan(reading.detections[:, 0])
        return np.flatnonzero(~absent).tolist() if absent.any() else self._everybody

    def draw(self, num: int) -> tuple[Array, ...]:
        """Samples of the latest tracks, (num, 4) each, in random order."""
        if self._tracks is None:
            return tuple(self._draws(p, None, num) for p in range(len(self._names)))
        return tuple(self._draws(p, track, num) for p, track in zip(self._tracked, self._tracks, strict=True))

    def _conclude(
        self,
        time: float,
        particles: Sequence[Array] | Array,
        weights: Sequence[Array] | Array,
        mean: Sequence[Array] | Array,
        covariance: Sequence[Array] | Array,
        ess: Sequence[float] | Array,
        recovered: NDArray[np.bool_] | None = None,
        tracked: Sequence[int] | None = None,
    ) -> tuple[Track, ...]:
        """The latest tracks, of all people or of those who are `tracked`, from a row a person of everything."""
        again = (False,) * len(self._names) if recovered is None else recovered.tolist()
        rows = zip(
            particles, weights, mean, covariance, np.asarray(ess, float).tolist(), self._radii, again, strict=True
        )
        self._tracks = tuple(Track(name, time, *row) for name, row in zip(self._names, rows, strict=True))
        self._tracked = self._everybody if tracked is None else tracked
        if len(self._tracked) < len(self._names):
            self._tracks = tuple(self._tracks[p] for p in self._tracked)
        return self._tracks
