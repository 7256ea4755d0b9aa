"""The distance from every point of a floor to the nearest surface, on a regular grid, read between its nodes.

At the nodes it is the exact clearance (`Floor.clearance`), not the distance to the nearest occupied cell that a
distance transform of a picture gives: that one errs by up to half a cell's diagonal. The clearance is negative inside a
body and so has no bend at the surface, where readings of a lidar end: beside a straight face bilinear interpolation is
exact. Beside a disc of radius r it errs by about cell^2 / (4 r), and by up to a cell where two bodies are equally near.
"""

from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, kernel, scalar
from mjnav.constant import Constant
from mjnav.geometry.floor import Floor
from mjnav.messages import Array

CELL = 0.05  # [m], the resolution of common maps; more where a floor has more than MAX_CELLS
MAX_CELLS = 1000  # along each axis
MARGIN = 1.0  # [m] around all that stands there


class FieldGrid(NamedTuple):
    """A field as kernels take it."""

    clearance: Matrix  # (rows along y, columns along x) [m] at the nodes; (0, 0) of an empty floor
    x: float  # [m] of the node [0, 0]
    y: float
    cell: float  # [m] between neighbouring nodes


@dataclass(frozen=True, slots=True)
class DistanceField(Constant):
    """The clearance of a floor, made once and looked up often."""

    grid: FieldGrid

    @classmethod
    def of(cls, floor: Floor, cell: float = CELL) -> "DistanceField":
        """Of a floor, with nodes `cell` [m] apart, to MARGIN around all that stands there.

        A floor of more than MAX_CELLS along an axis has larger cells.
        """
        bounds = floor.bounds
        if bounds is None:
            return cls(FieldGrid(np.zeros((0, 0)), 0.0, 0.0, cell))
        low, high = bounds[0] - MARGIN, bounds[1] + MARGIN
        cell = max(cell, float((high - low).max()) / (MAX_CELLS - 1))
        columns, rows = (ceil(side / cell) + 1 for side in high - low)
        empty = cls(FieldGrid(np.empty((rows, columns)), float(low[0]), float(low[1]), cell))
        return cls(empty.grid._replace(clearance=floor.clearance(empty.nodes)))

    @property
    def nodes(self) -> Array:
        """Where they are, (rows, columns, 2) [m]."""
        (rows, columns), cell = self.grid.clearance.shape, self.grid.cell
        x, y = np.meshgrid(self.grid.x + cell * np.arange(columns), self.grid.y + cell * np.arange(rows))
        return np.stack([x, y], axis=-1)

    def clearance(self, points: ArrayLike) -> Array:
        """From each of `points` (n, 2) to the nearest surface [m], negative inside a body; inf on an empty floor."""
        return _looked_up(rows_of(points), self.grid)[:, 0]

    def gradient(self, points: ArrayLike) -> Array:
        """Of the clearance at `points` (n, 2), (n, 2): about the unit vector away from the nearest surface.

        That of the interpolation, which jumps at the sides of a cell; 0 on an empty floor.
        """
        return _looked_up(rows_of(points), self.grid)[:, 1:].copy()


def rows_of(points: ArrayLike) -> Array:
    """Points (n, 2) as a kernel takes them."""
    return np.ascontiguousarray(np.asarray(points, float).reshape(-1, 2))


@scalar
def interpolated(values, u, v):
    """Bilinear interpolation in `values` at column u and row v, which lie within it, and its derivatives by both."""
    i, j = min(int(u), values.shape[1] - 2), min(int(v), values.shape[0] - 2)
    s, t = u - i, v - j
    near, right, above, far = values[j, i], values[j, i + 1], values[j + 1, i], values[j + 1, i + 1]
    below_change, above_change = right - near, far - above
    below_value, above_value = near + s * below_change, above + s * above_change
    return (
        below_value + t * (above_value - below_value),
        below_change + t * (above_change - below_change),
        (above_value - below_value),
    )


@scalar
def lookup(grid, x, y):
    """The clearance at a point [m] and its derivatives by x and y, of a `FieldGrid`, for use in other kernels.

    c = (1 - s)(1 - t) c_00 + s (1 - t) c_01 + (1 - s) t c_10 + s t c_11 with the point's place (s, t) in its cell.
    Outside the grid it is that of the nearest point of the grid and the way to it. A NaN of a point comes back.
    """
    values = grid.clearance
    if values.shape[0] == 0:
        return np.inf, 0.0, 0.0
    inverse = 1.0 / grid.cell
    last_column, last_row = values.shape[1] - 1, values.shape[0] - 1
    u, v = (x - grid.x) * inverse, (y - grid.y) * inverse
    inside_u, inside_v = min(max(u, 0.0), float(last_column)), min(max(v, 0.0), float(last_row))
    if not (u == u and v == v):
        return np.nan, np.nan, np.nan
    value, by_x, by_y = interpolated(values, inside_u, inside_v)
    by_x, by_y = inverse * by_x, inverse * by_y
    if inside_u != u or inside_v != v:
        out_x, out_y = (u - inside_u) * grid.cell, (v - inside_v) * grid.cell
        way = np.sqrt(out_x * out_x + out_y * out_y)
        value, by_x, by_y = value + way, out_x / way, out_y / way
    return value, by_x, by_y


@kernel
def _looked_up(points: Matrix, grid: FieldGrid):
    """Clearance and gradient at points (n, 2), a row each: (n, 3)."""
    found = np.empty((len(points), 3))
    for i in range(len(points)):
        found[i, 0], found[i, 1], found[i, 2] = lookup(grid, points[i, 0], points[i, 1])
    return found
