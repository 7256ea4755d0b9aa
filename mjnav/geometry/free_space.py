"""The free space of a scene on a regular grid: where a disc fits, which points it can go between, and by which way.

The clearance of a point is its distance to the nearest surface, and changes by no more than the point moves. A disc of
radius r that moves straight between the centres of two neighbouring cells therefore touches nothing where both
clearances are at least r + half of the distance between them: only such cells count as free, and no way through them is
wrong. A gap that is narrower than 2 r + 2 cells may be missed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, hypot, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.geometry.clearance import segment_distance
from mjnav.messages import Array

CELL = 0.05  # [m], the resolution of common maps; more where a scene has more than MAX_CELLS
MAX_CELLS = 1000  # along each axis
MARGIN = 1.5  # [m] around all that stands there and all points: a disc may go round everything


@dataclass(frozen=True)
class FreeSpace:
    """The clearance of every cell's centre; `discs` and `boxes` are the surfaces that it was computed from."""

    low: tuple[float, float]  # centre of the cell [0, 0]
    cell: float  # side of a cell [m]
    clearance: Array  # (rows along y, columns along x) [m], at most `reach`, negative inside a body
    discs: Array  # (n, 3) x, y, radius [m]
    boxes: Array  # (m, 6) centre x, y; unit vector along, x, y; half length, half thickness [m]

    @classmethod
    def of(cls, discs: ArrayLike, boxes: ArrayLike, points: ArrayLike, *, reach: float = 1.0) -> "FreeSpace":
        """Around discs (n, 3), boxes (m, 6) and points (k, 2), which stand for all that has to be on the grid.

        No disc asked for later may be wider than `reach` [m], less one cell.
        """
        discs, boxes = np.reshape(np.asarray(discs, float), (-1, 3)), np.reshape(np.asarray(boxes, float), (-1, 6))
        extent = np.hypot(boxes[:, 4], boxes[:, 5])[:, None]
        corners = np.concatenate(
            [
                np.reshape(np.asarray(points, float), (-1, 2)),
                *(discs[:, :2] + sign * discs[:, 2:] for sign in (-1, 1)),
                *(boxes[:, :2] + sign * extent for sign in (-1, 1)),
            ]
        )
        low, high = corners.min(axis=0) - MARGIN, corners.max(axis=0) + MARGIN
        cell = max(CELL, float((high - low).max()) / (MAX_CELLS - 1))
        columns, rows = (ceil(side / cell) + 1 for side in high - low)
        clearance = np.full((rows, columns), float(reach))
        x, y = low[0] + cell * np.arange(columns), low[1] + cell * np.arange(rows)
        for body, size in [*zip(discs, discs[:, 2], strict=True), *zip(boxes, extent[:, 0], strict=True)]:
            i = slice(*np.searchsorted(y, (body[1] - size - reach, body[1] + size + reach)))
            j = slice(*np.searchsorted(x, (body[0] - size - reach, body[0] + size + reach)))
            near = np.stack(np.broadcast_arrays(x[None, j], y[i, None]), axis=-1)
            np.minimum(clearance[i, j], _surface_distance(near, body), out=clearance[i, j])
        return cls((float(low[0]), float(low[1])), cell, clearance, discs, boxes)

    def distance(self, points: ArrayLike) -> Array:
        """The exact clearance of points (..., 2), by the surfaces and not by the grid [m]; inf where there are none."""
        points = np.asarray(points, float)
        found = np.full(points.shape[:-1], np.inf)
        for body in (*self.discs, *self.boxes):
            np.minimum(found, _surface_distance(points, body), out=found)
        return found

    def free(self, radius: float) -> NDArray[np.bool_]:
        """The cells between which a disc of `radius` may go, to each of the eight neighbours that is free, too."""
        return self.clearance >= radius + 0.5 * sqrt(2.0) * self.cell

    def parts(self, radius: float) -> NDArray[np.int32]:
        """The number of the connected part that each free cell belongs to; 0 for a cell that is not free."""
        from scipy.ndimage import label

        parts, _ = label(self.free(radius), np.ones((3, 3)))  # type: ignore[misc]
        return np.asarray(parts, np.int32)

    def part_of(self, points: ArrayLike, radius: float, tolerance: float = 0.0) -> NDArray[np.int32]:
        """The part in which each of the points (k, 2) lies, 0 for none; (k,).

        A point belongs to the nearest free cell that is at most `tolerance` [m] away, and at least the cell's diagonal.
        """
        parts = self.parts(radius)
        cells = [self._nearest(point, parts > 0, tolerance) for point in np.reshape(np.asarray(points, float), (-1, 2))]
        return np.array([0 if cell is None else parts[cell] for cell in cells], np.int32)

    def connects(self, points: ArrayLike, radius: float, tolerance: float = 0.0) -> bool:
        """Whether a disc can go from each of the points (k, 2) to every other; `tolerance` as in `part_of`."""
        found = self.part_of(points, radius, tolerance)
        return bool(len(found) == 0 or (found[0] > 0 and (found == found[0]).all()))

    def way(self, start: Sequence[float], goal: Sequence[float], radius: float, tolerance: float = 0.0) -> Array | None:
        """A short way of a disc from `start` to `goal`: the corners of a polyline with both ends, (n, 2).

        None where there is no way. The shortest way through the grid, then straightened where the straight line between
        two of its points is free; `tolerance` as in `part_of`.
        """
        from scipy.sparse.csgraph import dijkstra

        free = self.free(radius)
        ends = [self._nearest(np.asarray(point, float), free, tolerance) for point in (start, goal)]
        if ends[0] is None or ends[1] is None:
            return None
        graph, number = self._graph(radius)
        first, last = (int(number[end]) for end in ends)
        length, before = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
        if not np.isfinite(length[last]):
            return None
        steps = [last]
        while steps[-1] != first:
            steps.append(int(before[steps[-1]]))
        rows, columns = np.nonzero(free)
        cells = steps[::-1]
        middle = np.stack([self.low[0] + self.cell * columns[cells], self.low[1] + self.cell * rows[cells]], axis=1)
        return self._straightened(np.concatenate([[start], middle, [goal]]), radius)

    def sees(self, start: ArrayLike, end: ArrayLike, radius: float) -> bool:
        """Whether a disc can go straight from `start` to `end` [m], by the surfaces themselves."""
        start, end = np.asarray(start, float), np.asarray(end, float)
        if len(self.discs) and (segment_distance(self.discs[:, :2], start, end) < self.discs[:, 2] + radius).any():
            return False
        length, done = hypot(*(end - start)), 0.0
        boxes = FreeSpace(self.low, self.cell, self.clearance, self.discs[:0], self.boxes)
        while True:  # a disc that keeps a distance d may go d further without a look
            room = float(boxes.distance(start + (end - start) * (done / length if length else 0.0))) - radius
            if room < 0.0 or done >= length:
                return room >= 0.0
            done = min(length, done + max(room, 0.2 * self.cell))

    def _nearest(self, point: Array, free: NDArray[np.bool_], tolerance: float) -> tuple[int, int] | None:
        """Row and column of the nearest free cell."""
        reach = max(tolerance, sqrt(2.0) * self.cell)
        rows, columns = free.shape
        i, j = ((point[axis] - self.low[axis]) / self.cell for axis in (1, 0))
        wide = reach / self.cell
        i0, j0 = max(0, ceil(i - wide)), max(0, ceil(j - wide))
        window = free[i0 : min(rows, int(i + wide) + 1), j0 : min(columns, int(j + wide) + 1)]
        found = np.argwhere(window)
        if not len(found):
            return None
        distance = np.hypot(found[:, 0] + i0 - i, found[:, 1] + j0 - j)
        best = int(distance.argmin())
        return (int(found[best, 0]) + i0, int(found[best, 1]) + j0) if distance[best] <= wide else None

    def _graph(self, radius: float):
        """The free cells with their distances to their neighbours, as a sparse matrix; and each cell's number in it."""
        from scipy.sparse import coo_array

        free = self.free(radius)
        number = np.full(free.shape, -1)
        number[free] = np.arange(free.sum())
        rows, columns = free.shape
        pairs, weights = [], []
        for di, dj in ((0, 1), (1, 0), (1, 1), (1, -1)):
            here = number[: rows - di, max(0, -dj) : columns - max(0, dj)]
            there = number[di:, max(0, dj) : columns + min(0, dj)]
            both = (here >= 0) & (there >= 0)
            pairs.append(np.stack([here[both], there[both]]))
            weights.append(np.full(int(both.sum()), hypot(di, dj) * self.cell))
        count = int(free.sum())
        return coo_array((np.concatenate(weights), np.concatenate(pairs, axis=1)), shape=(count, count)).tocsr(), number

    def _straightened(self, way: Array, radius: float) -> Array:
        """The way without the points that a straight line can pass by."""
        kept, here = [0], 0
        while here < len(way) - 1:
            low, high = here + 1, len(way) - 1
            while low < high:  # the furthest point that is in sight, by halving
                middle = (low + high + 1) // 2
                low, high = (middle, high) if self.sees(way[here], way[middle], radius) else (low, middle - 1)
            kept.append(low)
            here = low
        return way[kept]


def _surface_distance(points: Array, body: Array) -> Array:
    """From points (..., 2) to the surface of a disc (3,) or a box (6,) [m], negative inside."""
    x, y = points[..., 0] - body[0], points[..., 1] - body[1]
    if len(body) == 3:
        return np.hypot(x, y) - body[2]
    along, across = np.abs(x * body[2] + y * body[3]) - body[4], np.abs(y * body[2] - x * body[3]) - body[5]
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return outside + np.minimum(np.maximum(along, across), 0.0)
