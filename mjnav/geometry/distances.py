"""Plane geometry for beliefs, tracks and scans: distances, 95 % ellipses, nearest pairs of points, lidar beams.

The ellipse holds 95 % of a Gaussian in the plane. Of two sets of points as many pairs are made as a gate allows, at the
least total distance. For a planar lidar, this file says where beams begin and where they point to.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, sin, sqrt
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.messages import Array

# ---------------------------------------------------------------------------- distance from a segment


def segment_distance(points: ArrayLike, start: ArrayLike, end: ArrayLike) -> Array:
    """Least distance of each point from the segment start-end [m]; the last axis of all is 2, the others broadcast."""
    points, start, end = (np.asarray(a, float) for a in (points, start, end))
    along = end - start
    length_squared = np.maximum(np.add.reduce(along * along, -1), np.finfo(float).tiny)
    from_start = points - start
    t = np.minimum(np.maximum(np.add.reduce(from_start * along, -1) / length_squared, 0.0), 1.0)
    return np.sqrt(np.add.reduce(np.square(from_start - t[..., None] * along), -1))


# --------------------------------------------------------------------------------------- 95 % ellipse


CHI_SQUARED_95 = 5.991  # with two degrees of freedom


def widest_std(covariance: ArrayLike) -> float:
    """The standard deviation of x and y in their widest direction [m]; `covariance` as in `ellipse_95`."""
    (a, b), (_, c) = np.asarray(covariance, float)[:2, :2].tolist()
    return sqrt(max(0.5 * (a + c) + hypot(0.5 * (a - c), b), 0.0))


def ellipse_95(covariance: ArrayLike) -> tuple[float, float, float]:
    """The 95 % region of x and y: semi-axes [m], the longer first, and the longer one's direction [rad].

    `covariance` is (2, 2) or larger, of which the first two rows and columns count [m^2].
    """
    (a, b), (_, c) = np.asarray(covariance, float)[:2, :2].tolist()
    middle, spread = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    longer, shorter = np.sqrt(CHI_SQUARED_95 * np.maximum([middle + spread, middle - spread], 0.0)).tolist()
    return longer, shorter, 0.5 * atan2(2.0 * b, a - c)


# -------------------------------------------------------------------------------------- nearest pairs


GATE = 1.0  # [m] between a person and a track at most, for it to count as the person's in figures


class HasMean(Protocol):
    """A belief about a person."""

    @property
    def mean(self) -> NDArray[Any]:
        """(4,) x, y, vx, vy."""
        ...


Belief = TypeVar("Belief", bound=HasMean)


def nearest_tracks(people: ArrayLike, tracks: Sequence[Belief]) -> dict[int, Belief]:
    """Of people at (P, 2) [m], those who have a track at most GATE away, each with the one that it is paired with."""
    means = [track.mean[:2] for track in tracks]
    return {person: tracks[j] for person, j in nearest_pairs(people, means, GATE)} if means else {}


def nearest_pairs(first: ArrayLike, second: ArrayLike, gate: float) -> list[tuple[int, int]]:
    """(i, j) of points first (n, 2) and second (m, 2) [m] that are paired, in the order of i; each at most once.

    Minimises the sum over pairs of the distance plus `gate` [m] for each point of `first` that has none, so no pair is
    farther apart than the gate. Points that are NaN are left out.
    """
    from scipy.optimize import linear_sum_assignment

    first, second = np.reshape(first, (-1, 2)), np.reshape(second, (-1, 2))
    rows, columns = (np.flatnonzero(np.isfinite(points).all(axis=1)) for points in (first, second))
    if not (rows.size and columns.size):
        return []
    distance = np.linalg.norm(first[rows, None] - second[columns], axis=-1)
    chosen = linear_sum_assignment(np.minimum(distance, gate))
    return [(int(rows[i]), int(columns[j])) for i, j in zip(*chosen, strict=True) if distance[i, j] <= gate]


# ---------------------------------------------------------------------------------------- lidar beams


WHOLE_TURN = 2.0 * np.pi  # [rad]


def beam_angles(num_beams: int, field_of_view: float = WHOLE_TURN) -> Array:
    """Of each beam against the lidar's heading, (B,) [rad], counter-clockwise.

    2 pi i / B - pi over a whole turn; over a smaller field of view F from -F/2 to F/2, both ends included.
    """
    if field_of_view >= WHOLE_TURN:
        return WHOLE_TURN * np.arange(num_beams) / num_beams - np.pi
    return np.linspace(-0.5 * field_of_view, 0.5 * field_of_view, num_beams)


def placed(pose: Array, mount: Array) -> Array:
    """The pose (3,) in the world of what is mounted at `mount` (3,) on a body at `pose` (3,)."""
    (x, y, heading), (ahead, left, yaw) = pose.tolist(), mount.tolist()
    c, s = cos(heading), sin(heading)
    return np.array([x + c * ahead - s * left, y + s * ahead + c * left, heading + yaw])
