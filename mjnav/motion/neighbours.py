"""Who is near whom: points sorted into the cells of a grid, so that a crowd is not searched pair by pair.

The cells are squares with the search radius as their side (at least), so that the neighbours of a point are in its own
cell and the eight around it. Neighbours are given in the order of their indices: sums over them have the same bits
whatever the grid looks like.
"""

from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Indices, Matrix, exact

MAX_CELLS_A_POINT = 4  # more would be empty
FEW = 128  # points that are searched pair by pair, in one cell, in less time than cells take to be sorted


class Cells(NamedTuple):
    """A grid of `columns` x `rows` cells whose first corner is (x, y)."""

    x: float  # [m]
    y: float  # [m]
    side: float  # [m]
    columns: int
    rows: int
    start: Indices  # (columns * rows + 1,) where each cell's points begin in `point`
    point: Indices  # indices of points, cell by cell, ascending in each


@exact
def sort_into_cells(position: Matrix, radius: float):
    """The `Cells` of the points (m, 2) [m] for searches within `radius` [m]; points that are NaN are left out."""
    left, below, right, above = np.inf, np.inf, -np.inf, -np.inf
    num = 0
    for i in range(len(position)):
        if not np.isnan(position[i, 0]):
            left, right = min(left, position[i, 0]), max(right, position[i, 0])
            below, above = min(below, position[i, 1]), max(above, position[i, 1])
            num += 1
    if num == 0:
        left, below, right, above = 0.0, 0.0, 0.0, 0.0
    side = radius if num > FEW else max(radius, 2.0 * (right - left), 2.0 * (above - below))
    while (np.floor((right - left) / side) + 1.0) * (np.floor((above - below) / side) + 1.0) > (
        MAX_CELLS_A_POINT * num + 1
    ):
        side *= 2.0
    columns, rows = int((right - left) / side) + 1, int((above - below) / side) + 1
    cell = np.full(len(position), -1)
    start = np.zeros(columns * rows + 1, np.int64)
    for i in range(len(position)):
        if not np.isnan(position[i, 0]):
            cell[i] = int((position[i, 1] - below) / side) * columns + int((position[i, 0] - left) / side)
            start[cell[i] + 1] += 1
    for k in range(columns * rows):
        start[k + 1] += start[k]
    point, filled = np.empty(num, np.int64), start.copy()
    for i in range(len(position)):
        if cell[i] >= 0:
            point[filled[cell[i]]] = i
            filled[cell[i]] += 1
    return Cells(left, below, side, columns, rows, start, point)


@exact
def near(out, position, x, y, radius, cells):
    """Writes the indices of the points within `radius` of (x, y), ascending, to `out` (m,); returns how many."""
    column, row = int(np.floor((x - cells.x) / cells.side)), int(np.floor((y - cells.y) / cells.side))
    count = 0
    for r in range(max(row - 1, 0), min(row + 2, cells.rows)):
        for c in range(max(column - 1, 0), min(column + 2, cells.columns)):
            cell = r * cells.columns + c
            for k in range(cells.start[cell], cells.start[cell + 1]):
                j = cells.point[k]
                dx, dy = position[j, 0] - x, position[j, 1] - y
                if dx * dx + dy * dy <= radius * radius:
                    place = count
                    while place > 0 and out[place - 1] > j:
                        out[place] = out[place - 1]
                        place -= 1
                    out[place] = j
                    count += 1
    return count
