"""Which points of a floor a round body can go between, on a regular grid.

The clearance of a point changes by no more than the point moves. A disc of radius r that moves straight between the
centres of two neighbouring cells therefore touches nothing where both clearances are at least r + half of the distance
between them: only such cells count as free, and no way through them is wrong. A gap that is narrower than 2 r + 2 cells
may be missed. `shortest_way` is exact, and takes longer the more bodies there are; a grid says for every place at once
what is connected.
"""

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.geometry.floor import Floor
from mjnav.messages import Array

CELL = 0.05  # [m], the resolution of common maps; more where a scene has more than MAX_CELLS
MAX_CELLS = 1000  # along each axis
MARGIN = 1.5  # [m] around all that stands there and all points: a disc may go round everything


@dataclass(frozen=True, slots=True)
class FreeSpace:
    """The clearance of every cell's centre."""

    low: tuple[float, float]  # centre of the cell [0, 0]
    cell: float  # side of a cell [m]
    clearance: Array  # (rows along y, columns along x) [m], negative inside a body

    @classmethod
    def of(cls, floor: Floor, points: ArrayLike) -> "FreeSpace":
        """Around all bodies of a floor and around `points` (k, 2), of which there is at least one."""
        extent = np.hypot(floor.boxes[:, 4], floor.boxes[:, 5])[:, None]
        ends = [np.reshape(np.asarray(points, float), (-1, 2))]
        for sign in (-1, 1):
            ends += [floor.discs[:, :2] + sign * floor.discs[:, 2:], floor.boxes[:, :2] + sign * extent]
        corners = np.concatenate(ends)
        low, high = corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN
        cell = max(CELL, float((high - low).max()) / (MAX_CELLS - 1))
        columns, rows = (ceil(side / cell) + 1 for side in high - low)
        x, y = np.meshgrid(low[0] + cell * np.arange(columns), low[1] + cell * np.arange(rows))
        return cls((float(low[0]), float(low[1])), cell, floor.clearance(np.stack([x, y], axis=-1)))

    def parts(self, radius: float) -> NDArray[np.int32]:
        """The number of the connected part that each cell belongs to for a disc; 0 for a cell that is not free."""
        from scipy.ndimage import label

        free = self.clearance >= radius + 0.5 * sqrt(2.0) * self.cell
        parts, _ = label(free, np.ones((3, 3)))  # type: ignore[misc]
        return np.asarray(parts, np.int32)

    def part_of(self, points: ArrayLike, radius: float, tolerance: float = 0.0) -> NDArray[np.int32]:
        """The part in which each of the points (k, 2) lies, 0 for none; (k,).

        A point belongs to the nearest free cell that is at most `tolerance` [m] away, or a cell's diagonal.
        """
        parts = self.parts(radius)
        return np.array([_near(parts, place, reach)[1] for place, reach in self._cells(points, tolerance)], np.int32)

    def connects(self, points: ArrayLike, radius: float, tolerance: float = 0.0) -> bool:
        """Whether a disc can go from each of the points (k, 2) to every other; `tolerance` as in `part_of`."""
        found = self.part_of(points, radius, tolerance)
        return bool(len(found) == 0 or (found[0] > 0 and (found == found[0]).all()))

    def first_cut_off(self, points: ArrayLike, radius: float, tolerance: float = 0.0) -> int | None:
        """The first of the points (k, 2) that a disc from the first one surely cannot come to within `tolerance` [m].

        None where there is none. Errs the other way than `connects`: a cell counts as free where the disc may have its
        centre anywhere in it, so that no way is missed and a gap up to two cells too narrow is let pass.
        """
        spare = radius - sqrt(2.0) * self.cell
        if spare + 0.5 * sqrt(2.0) * self.cell <= 0.0:
            return None  # such cells would lie inside bodies
        parts = self.parts(spare)
        common: set[int] | None = None
        for i, (place, reach) in enumerate(self._cells(points, tolerance)):
            found, _ = _near(parts, place, reach if i else sqrt(2.0))
            common = found if common is None else common & found
            if not common:
                return i
        return None

    def _cells(self, points: ArrayLike, tolerance: float) -> list[tuple[Array, float]]:
        """Each point as row and column, which may lie between cells, and the tolerance in cells."""
        places = (np.reshape(np.asarray(points, float), (-1, 2)) - self.low) / self.cell
        return [(place[::-1], max(tolerance / self.cell, sqrt(2.0))) for place in places]


def _near(parts: NDArray[np.int32], place: Array, reach: float) -> tuple[set[int], int]:
    """The parts of the cells within reach of a place, and that of the nearest one, 0 where there is none; in cells."""
    first = np.maximum(np.ceil(place - reach), 0).astype(int)
    last = np.maximum(np.floor(place + reach) + 1, 0).astype(int)
    found = np.argwhere(parts[first[0] : last[0], first[1] : last[1]]) + first
    distance = np.hypot(*(found - place).T)
    if not len(found) or distance.min() > reach:
        return set(), 0
    numbers = parts[tuple(found.T)]
    return set(numbers[distance <= reach].tolist()), int(numbers[distance.argmin()])
