"""Filters of one track for the tracker by lidar: interface, particle filter, and the error of the robot's pose.

That error is common to all tracks: a pose error (dx, dy, dtheta) moves what stands at p from the robot at p_r by

    J (dx, dy, dtheta),   J = (I, e),   e = (-(y - y_r), x - x_r)

A filter is told of it with every detection as if it were fresh at each scan. It is not: under the pose sensor a tenth
of a second leaves four fifths of it. So the filter averages away a part of it that in truth stays, and a track gets
back the share PERSISTENT of its covariance. More would make the velocities follow the pose's errors, or the positions
too uncertain: with a half, the 95 % regions of positions hold 94 to 99 % of the truth in the shipped scenes hall, five
and doorway.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from typing import Protocol, Self

import numpy as np

from mjnav.estimation.base import HEADING
from mjnav.estimation.walk_filter import WalkFilter
from mjnav.filters.mixture_kalman import GaussianSum
from mjnav.filters.particles import shuffled
from mjnav.geometry.angles import wrap
from mjnav.messages import Array, RobotBelief

# ------------------------------------------------------------------------ error of the robot's pose


PERSISTENT = 0.5


@dataclass(frozen=True, slots=True)
class FrameError:
    """What one belief of the robot's pose does to all tracks."""

    place: Array  # (2,) [m] of the robot
    pose_covariance: Array  # (3, 3), PERSISTENT of it
    errors: Array  # (n, 3) of the pose, with that covariance

    @classmethod
    def of(cls, robot: RobotBelief, num: int, rng: np.random.Generator) -> Self:
        """`num` errors by the belief's own particles, whatever their law."""
        errors = shuffled(robot.particles, robot.weights, num, rng) - robot.mean
        errors[:, HEADING] = wrap(errors[:, HEADING])
        return cls(robot.mean[:2], PERSISTENT * robot.covariance, sqrt(PERSISTENT) * errors)

    @classmethod
    def none(cls, num: int) -> Self:
        """No error."""
        return cls(np.zeros(2), np.zeros((3, 3)), np.zeros((num, 3)))

    def covariance(self, position: Array) -> Array:
        """Of the error at a position (2,) [m]: (2, 2)."""
        J = self._by_pose(position)
        return J @ self.pose_covariance @ J.T

    def samples(self, position: Array) -> Array:
        """Errors at a position (2,) [m]: (n, 2)."""
        return self.errors @ self._by_pose(position).T

    def _by_pose(self, position: Array) -> Array:
        x, y = (position - self.place).tolist()
        return np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])


# ------------------------------------------------------------------------------- filters of a track


Detectable = Callable[[Array], Array]  # points (n, 2) [m] -> probability that a body there would have been detected


class TrackFilter(Protocol):
    """The belief about one body's x, y, vx, vy."""

    @property
    def mean(self) -> Array:
        """(4,)"""
        ...

    @property
    def covariance(self) -> Array:
        """(4, 4)"""
        ...

    def start(self, position: Array, covariance: Array) -> None:
        """Begins at a position (2,) known with a covariance (2, 2)."""
        ...

    def predict(self, interval: float) -> None:
        """Moves by `interval` [s]."""
        ...

    def correct(self, position: Array, covariance: Array, age: float) -> None:
        """Conditions on a position (2,) measured `age` [s] before, with an error of mean zero and that covariance."""
        ...

    def log_density(self, positions: Array, covariances: Array, ages: Array) -> Array:
        """Log of the density of detections at positions (d, 2), covariances (d, 2, 2), made `ages` (d,) [s] before."""
        ...

    def missed(self, detectable: Detectable) -> float:
        """Conditions on not having been detected, as far as its shape can; returns how probable a detection was."""
        ...

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """Equally weighted states, (num, 4)."""
        ...


# The error of a detection in units of the root of its covariance, with variance 1. Detectors know the covariance, not
# the shape: most err less than it says, one in twenty twice as far, where a cluster holds part of something else.
SCAN_ERROR = GaussianSum(np.array([0.95, 0.05]), np.zeros((2, 2)), np.array([0.8 * np.eye(2), 4.8 * np.eye(2)]))
HISTORIES = 100  # of a track at most: twice as many changed no error of a track in the shipped scenes by 2 %
TINY = 1e-300  # [1/m^2] the least density of which there is a logarithm
JUDGED = 32  # particles by which it is judged whether a body could have been seen


class ParticleTrackFilter:
    """`WalkFilter` with a scan's detections; its particles also know which of them would have been seen."""

    def __init__(self, num_particles: int, rng: np.random.Generator, error: GaussianSum = SCAN_ERROR):
        """`error` is the shape of a detection's error, in units of the root of its covariance."""
        self._walk, self._error = WalkFilter(min(num_particles, HISTORIES), rng), error

    @property
    def mean(self) -> Array:
        """(4,)"""
        return self._walk.mean

    @property
    def covariance(self) -> Array:
        """(4, 4)"""
        return self._walk.covariance

    def start(self, position: Array, covariance: Array) -> None:
        """See `TrackFilter`."""
        self._walk.start(position, self._error.stretched(covariance))

    def predict(self, interval: float) -> None:
        """See `TrackFilter`."""
        self._walk.predict(interval)

    def correct(self, position: Array, covariance: Array, age: float) -> None:
        """See `TrackFilter`."""
        self._walk.correct(position, self._error.stretched(covariance), age=age)

    def log_density(self, positions: Array, covariances: Array, ages: Array) -> Array:
        """See `TrackFilter`."""
        found = [
            self._walk.density(position, self._error.stretched(covariance), age=age)
            for position, covariance, age in zip(positions, covariances, ages.tolist(), strict=True)
        ]
        return np.log(np.maximum(found, TINY))

    def missed(self, detectable: Detectable) -> float:
        """Weighs the heaviest particles by the probability that a body of theirs is missed, the others by its mean."""
        owner, points = self._walk.heaviest(JUDGED)
        missed = 1.0 - detectable(points.reshape(-1, 2)).reshape(2, -1).mean(axis=0)
        return 1.0 - self._walk.reweigh(owner, missed)

    def draw(self, num: int, rng: np.random.Generator) -> Array:
        """See `TrackFilter`."""
        return self._walk.draw(num, rng)
