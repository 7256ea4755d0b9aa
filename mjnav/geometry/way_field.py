"""The length of the shortest way that a round body has left to a goal, from every point of a floor.

The grid holds the detour T(x) - |x - goal| >= 0 of the way T (`fast_sweeping`) over the straight one. The detour is
bilinear between nodes and |x - goal| is added exactly: where the straight way is open, T is |x - goal|. Behind bodies T
is too long by up to about a cell for each body that the way goes round, and never too short by more than interpolation.

A place without room for the disc has a way, too: that of the nearest node with room, and `fast_sweeping.OUTSIDE` times
the distance to it. `shortest_way` has the exact ways; it takes longer, and has none from such a place.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.geometry.compiled import kernel, scalar
from mjnav.geometry.distance_field import interpolated
from mjnav.geometry.fast_sweeping import WayGrid, solve
from mjnav.geometry.floor import Floor
from mjnav.geometry.kernel_types import Matrix
from mjnav.messages import Array

CELL = 0.1  # [m]; more where a floor has more than MAX_CELLS, less for a disc of a radius below it
MAX_CELLS = 1000  # along each axis
MARGIN = 3  # [cells] around the places where the disc touches a body


@dataclass(frozen=True, slots=True)
class WayField(Constant):
    """The way left to one goal, made once and looked up often."""

    grid: WayGrid

    @classmethod
    def of(cls, floor: Floor, goal: ArrayLike, radius: float, points: ArrayLike = (), cell: float = CELL) -> "WayField":
        """Of a disc of `radius` [m] to `goal` (2,), with nodes `cell` [m] apart around all bodies and `points` (k, 2).

        Raises InvalidValue for a `radius` or a `cell` that is not positive, and for a goal that is not finite.
        """
        for name, value in (("radius", radius), ("cell", cell)):
            if not 0.0 < value < np.inf:
                raise InvalidValue(name, value, "a finite number > 0")
        gx, gy = (float(v) for v in np.asarray(goal, float))
        if not np.isfinite([gx, gy]).all():
            raise InvalidValue("goal", (gx, gy), "two finite numbers")
        bounds = floor.bounds
        if bounds is None:
            return cls(WayGrid(np.zeros((0, 0)), gx, gy, cell, gx, gy))
        cell = min(cell, 0.75 * radius)  # a wall that the disc cannot pass is then wider than a cell's diagonal
        ends = np.concatenate([[[gx, gy]], bounds[0][None] - radius, bounds[1][None] + radius, _rows(points)])
        low, high = ends.min(axis=0) - MARGIN * cell, ends.max(axis=0) + MARGIN * cell
        cell = max(cell, float((high - low).max()) / (MAX_CELLS - 1))
        columns, rows = (ceil(side / cell) + 1 for side in high - low)
        low -= 0.5 * (
            cell * np.array([columns - 1, rows - 1]) - (high - low)
        )  # the nodes of a mirrored floor are mirrored
        grid = WayGrid(np.empty((rows, columns)), float(low[0]), float(low[1]), cell, gx, gy)
        solve(grid, float(radius), np.ascontiguousarray(floor.discs), np.ascontiguousarray(floor.boxes))
        return cls(grid)

    def way_left(self, points: ArrayLike) -> Array:
        """From each of `points` (n, 2) to the goal [m], (n,)."""
        return _looked_up(_rows(points), self.grid)[:, 0].copy()

    def direction(self, points: ArrayLike) -> Array:
        """The unit vector along which the way goes on from each of `points` (n, 2), (n, 2).

        That is -grad T of the interpolation, which jumps at the sides of a cell; straight to the goal where the way is
        open; 0 at the goal.
        """
        slope = _looked_up(_rows(points), self.grid)[:, 1:]
        size = np.linalg.norm(slope, axis=1, keepdims=True)
        return -slope / np.where(size > 0.0, size, 1.0)


def _rows(points: ArrayLike) -> Array:
    return np.ascontiguousarray(np.asarray(points, float).reshape(-1, 2))


@scalar
def way_lookup(grid, x, y):
    """The way left from a point [m] and its derivatives by x and y, of a `WayGrid`, for use in other kernels.

    T = |x - goal| + the detour, bilinear between nodes. Outside the grid the detour is that of the nearest point of the
    grid. At the goal the derivative of |x - goal| is taken for 0. A NaN of a point comes back.
    """
    dx, dy = x - grid.goal_x, y - grid.goal_y
    straight = np.sqrt(dx * dx + dy * dy)
    inverse_straight = 1.0 / straight if straight > 0.0 else 0.0
    by_x, by_y = dx * inverse_straight, dy * inverse_straight
    values = grid.detour
    if values.shape[0] == 0 or straight != straight:  # a NaN
        return straight, by_x, by_y
    inverse = 1.0 / grid.cell
    u, v = (x - grid.x) * inverse, (y - grid.y) * inverse
    inside_u, inside_v = min(max(u, 0.0), values.shape[1] - 1.0), min(max(v, 0.0), values.shape[0] - 1.0)
    detour, by_u, by_v = interpolated(values, inside_u, inside_v)
    if inside_u == u:
        by_x += inverse * by_u
    if inside_v == v:
        by_y += inverse * by_v
    return straight + detour, by_x, by_y


@kernel
def _looked_up(points: Matrix, grid: WayGrid):
    """Way left and its gradient at points (n, 2), a row each: (n, 3)."""
    found = np.empty((len(points), 3))
    for i in range(len(points)):
        found[i, 0], found[i, 1], found[i, 2] = way_lookup(grid, points[i, 0], points[i, 1])
    return found
