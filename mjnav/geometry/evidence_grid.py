"""A grid of what beams say of a floor: the log odds of each cell that something stands in it.

    l <- l + HIT   in a cell in which beams of a scan end       (Moravec & Elfes 1985; Thrun, Burgard & Fox 2005,
    l <- l - PASS  in a cell that others pass and none ends in    table 9.1), kept within LEAST to MOST

each once a scan. A cell with l > OCCUPIED is occupied. It keeps the mean place of the beams that ended in it, so that a
surface is known as well as ranges are, and not to a cell's width only. It also keeps the mean covariance of the frames
in which their scans were placed.
"""

from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Cube, Flags, Matrix, Vector, kernel
from mjnav.geometry.distance_field import FieldGrid
from mjnav.messages import Array

CELL = 0.05  # [m]
HIT, PASS = 0.7, 0.35
LEAST, MOST = -1.0, 3.0
OCCUPIED = 1.0  # two scans' hits on what is unknown, three on what was seen free
FREE = -0.3  # below it a cell was seen free
UPPER = np.triu_indices(3)  # xx, xy, xt, yy, yt, tt of a covariance (3, 3)


class EvidenceGrid(NamedTuple):
    """Cells as kernels take them; the cell [0, 0] has its lower left corner at (x, y)."""

    odds: Matrix  # (n, n) l, rows along y
    places_x: Matrix  # (n, n) [m] mean place of the ends in each cell
    places_y: Matrix
    counts: Matrix  # (n, n) of these
    frames: Cube  # (n, n, 6) mean covariance of the frames of their scans, about the floor's origin, by UPPER
    x: float  # [m]
    y: float

    @classmethod
    def around(cls, x: float, y: float, half: float) -> "EvidenceGrid":
        """Nothing is known within `half` [m] of (x, y)."""
        n = 2 * int(np.ceil(half / CELL))
        low_x, low_y = (CELL * (np.floor(v / CELL) - n // 2) for v in (x, y))
        return cls(*np.zeros((4, n, n)), frames=np.zeros((n, n, 6)), x=float(low_x), y=float(low_y))

    @property
    def middle(self) -> Array:
        """(2,) [m]"""
        return np.array([self.x, self.y]) + 0.5 * CELL * len(self.odds)

    def moved(self, columns: int, rows: int) -> "EvidenceGrid":
        """The window shifted by cells; what leaves it is forgotten."""
        n = len(self.odds)
        x, y = self.x + CELL * columns, self.y + CELL * rows
        new = EvidenceGrid(*np.zeros((4, n, n)), frames=np.zeros((n, n, 6)), x=x, y=y)
        to_rows, to_columns = (slice(max(-k, 0), min(n - k, n)) for k in (rows, columns))
        from_rows, from_columns = (slice(max(k, 0), min(n + k, n)) for k in (rows, columns))
        for old, shifted in zip(self[:5], new[:5], strict=True):
            shifted[to_rows, to_columns] = old[from_rows, from_columns]
        return new

    def surfaces(self) -> Array:
        """Mean places of the occupied cells, row by row, (k, 2) [m]."""
        occupied = self.odds > OCCUPIED
        return np.column_stack([self.places_x[occupied], self.places_y[occupied]])


@kernel
def add_scan(grid: EvidenceGrid, origins: Matrix, ends: Matrix, met: Flags, frame: Vector):
    """What one scan says: beams from `origins` (B, 2) to `ends` (B, 2) [m], which have `met` a surface there or not.

    `frame` (6,) is the covariance of where the scan was placed, by UPPER.
    """
    n = len(grid.odds)
    seen = np.zeros((n, n), np.bool_)
    for b in range(len(ends)):
        i, j = int(np.floor((ends[b, 0] - grid.x) / CELL)), int(np.floor((ends[b, 1] - grid.y) / CELL))
        if not met[b] or not (0 <= i < n and 0 <= j < n):
            continue
        if not seen[j, i]:
            seen[j, i] = True
            grid.odds[j, i] = min(grid.odds[j, i] + HIT, MOST)
        grid.counts[j, i] += 1.0
        grid.places_x[j, i] += (ends[b, 0] - grid.places_x[j, i]) / grid.counts[j, i]
        grid.places_y[j, i] += (ends[b, 1] - grid.places_y[j, i]) / grid.counts[j, i]
        for k in range(len(frame)):
            grid.frames[j, i, k] += (frame[k] - grid.frames[j, i, k]) / grid.counts[j, i]
    for b in range(len(ends)):
        dx, dy = ends[b, 0] - origins[b, 0], ends[b, 1] - origins[b, 1]
        length = np.sqrt(dx * dx + dy * dy)
        steps = int((length - CELL) / (0.5 * CELL))  # the last cell is not passed
        for k in range(steps):
            share = 0.5 * CELL * k / length
            i = int(np.floor((origins[b, 0] + share * dx - grid.x) / CELL))
            j = int(np.floor((origins[b, 1] + share * dy - grid.y) / CELL))
            if 0 <= i < n and 0 <= j < n and not seen[j, i]:
                seen[j, i] = True
                grid.odds[j, i] = max(grid.odds[j, i] - PASS, LEAST)
                if grid.odds[j, i] <= 0.0:
                    grid.counts[j, i] = 0.0


@kernel
def stand(grid: EvidenceGrid, x: float, y: float, radius: float):
    """What a round body says that stands at (x, y) [m]: there is nothing else."""
    n = len(grid.odds)
    reach = int(radius / CELL)
    column, row = int(np.floor((x - grid.x) / CELL)), int(np.floor((y - grid.y) / CELL))
    for j in range(max(row - reach, 0), min(row + reach, n - 1) + 1):
        for i in range(max(column - reach, 0), min(column + reach, n - 1) + 1):
            if (i - column) * (i - column) + (j - row) * (j - row) <= reach * reach:
                grid.odds[j, i] = LEAST
                grid.counts[j, i] = 0.0


@kernel
def seen_free(grid: EvidenceGrid, pose: Vector, v: float, omega: float, radius: float, most: float):
    """How far [m] a disc gets from `pose` (3,) along the arc of (v, omega) over cells that were seen free, at most."""
    n, reach = len(grid.odds), int(radius / CELL)
    x, y, heading, way, step = pose[0], pose[1], pose[2], 0.0, 0.5 * CELL
    turn, sense = omega / abs(v) * step, 1.0 if v > 0.0 else -1.0
    while way < most:
        column, row = int(np.floor((x - grid.x) / CELL)), int(np.floor((y - grid.y) / CELL))
        for j in range(row - reach, row + reach + 1):
            for i in range(column - reach, column + reach + 1):
                if (i - column) * (i - column) + (j - row) * (j - row) <= reach * reach and (
                    not (0 <= i < n and 0 <= j < n) or grid.odds[j, i] > FREE
                ):
                    return way
        x += sense * step * np.cos(heading + 0.5 * turn)
        y += sense * step * np.sin(heading + 0.5 * turn)
        heading += turn
        way += step
    return most


@kernel
def distances_to(points: Matrix, field: FieldGrid, reach: float):
    """Fills `field.clearance` with the distance to the nearest of `points` (k, 2) [m], at most `reach`."""
    rows, columns = field.clearance.shape
    field.clearance[:] = reach
    far = reach / field.cell
    for p in range(len(points)):
        u, v = (points[p, 0] - field.x) / field.cell, (points[p, 1] - field.y) / field.cell
        begin, end = max(int(np.ceil(u - far)), 0), min(int(u + far), columns - 1) + 1
        for j in range(max(int(np.ceil(v - far)), 0), min(int(v + far), rows - 1) + 1):
            row = field.clearance[j, begin:end]  # from 0 on, for indices that may be negative do not vectorise
            for i in range(row.size):
                across = begin + i - u
                row[i] = min(row[i], field.cell * np.sqrt(across * across + (j - v) * (j - v)))


def field_of(points: Array, low: Array, size: float, cell: float, reach: float) -> FieldGrid:
    """The distance to the nearest of `points` (k, 2), at most `reach`, within `size` [m] from the corner `low` (2,)."""
    n = int(size / cell) + 1
    field = FieldGrid(np.empty((n, n)), float(low[0]), float(low[1]), cell)
    distances_to(np.ascontiguousarray(points), field, reach)
    return field
