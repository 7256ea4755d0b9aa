"""Pairs of points of two sets: as many as a gate allows, at the least total distance."""

from collections.abc import Sequence
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
