"""The length of the shortest way of a round body to a goal, from every point of a floor, by fast sweeping on a grid.

T(x) solves the eikonal equation |grad T| = w(x), T(goal) = 0 (Zhao 2005, "A fast sweeping method for eikonal
equations"). The slowness w is 1 where a disc has room, and BLOCKED where it has none: T is finite everywhere, and a way
leads through a body where no other does. Where a disc has room, but less than it likes, w grows to TIGHT: then T is no
length, but what a way costs that would rather keep clear; so it is where a way over unseen floor costs more. Two things
make a coarse grid accurate:

* Nodes to which the straight way from the goal is open have the exact distance. Sweeping begins where these end.
* A node's value comes from any of the 8 triangles around it (the semi-Lagrangian form of the upwind scheme, Tsitsiklis
  1995), not from 4 quadrants: a front around a corner errs by about cell / 8 log(distance / radius) at most.

The grid holds the detour T(x) - |x - goal| >= 0 of the way T over the straight one. The detour is bilinear between
nodes and |x - goal| is added exactly: where the straight way is open, T is |x - goal|. Behind bodies T is too long by
up to about a cell for each body that the way goes round, and never too short by more than interpolation.

A place without room for the disc has a way, too: that of the nearest node with room, and OUTSIDE times the distance to
it, the way out of the body. A robot whose belief is partly inside a body takes it. `shortest_way` has the exact ways;
it takes longer, and has none from such a place.
"""

from dataclasses import dataclass
from math import ceil, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, exact, kernel, scalar
from mjnav.constant import Constant
from mjnav.geometry.distance_field import FieldGrid, interpolated, rows_of
from mjnav.geometry.floor import TOUCH, Floor, box_surface, disc_surface, is_open
from mjnav.messages import Array

# -------------------------------------------------------------------------------------- fast sweeping


BLOCKED = 100.0  # slowness without room for the disc: through a wall is as far as 70 m around it
SPARE = 0.5  # [cells] that a node may lack of the room: a gap of the disc's width may have no node in its middle
SQUEEZE = 1.5  # slowness of a node that lacks all of SPARE
TIGHT = 3.0  # slowness beside a body, of a way that would rather keep clear of it
OUTSIDE = 2.0  # slowness of the way out of a body
SETTLED = 1e-9  # [m]; smaller changes end the sweeping


class WayGrid(NamedTuple):
    """A field as kernels take it."""

    detour: Matrix  # (rows along y, columns along x) [m], T - |x - goal| at the nodes; (0, 0) of an empty floor
    x: float  # [m] of the node [0, 0]
    y: float
    cell: float  # [m] between neighbouring nodes
    goal_x: float  # [m]
    goal_y: float


@exact
def solve(grid: WayGrid, radius: float, soft: float, discs: Matrix, boxes: Matrix, unseen: FieldGrid, factor: float):
    """Fills `grid.detour` for a disc that would rather keep `soft` [m] clear of bodies.

    A way over what is `unseen`, 1 there and 0 elsewhere, costs `factor` times its length. All arrays within have a rim
    of one node around the grid, which belongs to nothing.
    """
    rows, columns = grid.detour.shape
    lacking = np.zeros((rows + 2, columns + 2))
    wide = radius + soft
    for k in range(len(discs)):
        reach = discs[k, 2] + wide
        _mark(lacking, grid, wide, discs[k], True, reach, reach)
    for k in range(len(boxes)):
        along_x, along_y = abs(boxes[k, 2]), abs(boxes[k, 3])
        a, b = boxes[k, 4] + wide, boxes[k, 5] + wide
        _mark(lacking, grid, wide, boxes[k], False, along_x * a + along_y * b, along_y * a + along_x * b)
    spare = SPARE * grid.cell + TOUCH
    left = np.full((rows + 2, columns + 2), np.inf)
    fixed = np.ones((rows + 2, columns + 2), np.bool_)
    fixed[1:-1, 1:-1] = False
    weight = np.ones((rows + 2, columns + 2))
    if factor > 1.0:
        for j in range(rows):
            for i in range(columns):
                if _is_unseen(unseen, grid.x + i * grid.cell, grid.y + j * grid.cell):
                    weight[j + 1, i + 1] = factor
    _see(left, fixed, weight, grid, wide, discs, boxes)
    _sweep(left, fixed, lacking, weight, grid.cell, spare, soft)
    _leave(left, lacking, grid.cell, spare + soft)
    for j in range(rows):
        for i in range(columns):
            dx, dy = grid.x + i * grid.cell - grid.goal_x, grid.y + j * grid.cell - grid.goal_y
            grid.detour[j, i] = max(left[j + 1, i + 1] - np.sqrt(dx * dx + dy * dy), 0.0)


@exact
def _mark(lacking, grid, radius, body, is_disc, half_width, half_height):
    """What the disc lacks of its room [m] beside one body, in the rectangle of nodes around it."""
    rows, columns = grid.detour.shape
    i0 = max(int(np.floor((body[0] - half_width - grid.x) / grid.cell)), 0)
    i1 = min(int(np.ceil((body[0] + half_width - grid.x) / grid.cell)), columns - 1)
    j0 = max(int(np.floor((body[1] - half_height - grid.y) / grid.cell)), 0)
    j1 = min(int(np.ceil((body[1] + half_height - grid.y) / grid.cell)), rows - 1)
    for j in range(j0, j1 + 1):
        for i in range(i0, i1 + 1):
            x, y = grid.x + i * grid.cell, grid.y + j * grid.cell
            clearance = disc_surface(x, y, body)[0] if is_disc else box_surface(x, y, body)[0]
            lacking[j + 1, i + 1] = max(lacking[j + 1, i + 1], radius - clearance)


@exact
def _is_unseen(unseen, x, y):
    """Whether a point is, also beyond the grid."""
    rows, columns = unseen.clearance.shape
    i, j = int(np.floor((x - unseen.x) / unseen.cell + 0.5)), int(np.floor((y - unseen.y) / unseen.cell + 0.5))
    return not (0 <= i < columns and 0 <= j < rows) or unseen.clearance[j, i] > 0.0


@exact
def _see(left, fixed, weight, grid, radius, discs, boxes):
    """The exact distance at the nodes to which the straight way from the goal is open, spread from node to node.

    A goal that lacks room is approached straight, too: no body comes nearer than it is to the goal. Where even that is
    closed the nodes around the goal have their distance, so that the sweep has a beginning.
    """
    rows, columns = grid.detour.shape
    tried = fixed.copy()
    queue = np.empty((rows * columns, 2), np.int64)
    num = 0
    u, v = (grid.goal_x - grid.x) / grid.cell, (grid.goal_y - grid.y) / grid.cell
    for j in range(int(v) + 1, int(v) + 3):
        for i in range(int(u) + 1, int(u) + 3):
            tried[j, i] = True
            queue[num, 0], queue[num, 1] = j, i
            num += 1
    at = 0
    while at < num:
        j, i = queue[at, 0], queue[at, 1]
        at += 1
        x, y = grid.x + (i - 1) * grid.cell, grid.y + (j - 1) * grid.cell
        straight = np.sqrt((x - grid.goal_x) ** 2 + (y - grid.goal_y) ** 2)
        if at <= 4:
            left[j, i] = straight
        if not is_open(grid.goal_x, grid.goal_y, x, y, radius, discs, boxes):
            continue
        steps = int(straight / grid.cell) + 1
        dear = False
        for k in range(steps + 1):
            di, dj = u + 1.0 + (i - 1.0 - u) * k / steps, v + 1.0 + (j - 1.0 - v) * k / steps
            dear |= weight[int(dj + 0.5), int(di + 0.5)] > 1.0
        if dear:
            continue
        left[j, i] = straight
        fixed[j, i] = True
        for nj in range(j - 1, j + 2):
            for ni in range(i - 1, i + 2):
                if not tried[nj, ni]:
                    tried[nj, ni] = True
                    queue[num, 0], queue[num, 1] = nj, ni
                    num += 1


@exact
def _slowness(lacking, spare, soft):
    """1 with room for the disc, BLOCKED without, and up to TIGHT with less than `soft`; all in [m]."""
    if lacking <= 0.0:
        return 1.0
    if lacking <= soft:
        return 1.0 + (TIGHT - 1.0) * lacking / soft
    lacking -= soft
    if soft > 0.0 and lacking <= spare:
        return TIGHT
    return 1.0 + (SQUEEZE - 1.0) * lacking / spare if lacking <= spare else BLOCKED


@exact
def _sweep(left, fixed, lacking, weight, cell, spare, soft):
    """Fast sweeping in four orders until nothing changes; a node is visited when a neighbour has changed since.

    That is the locking of Bak, McLaughlin and Renzi (2010).
    """
    rows, columns = left.shape
    waiting = np.zeros(left.shape, np.bool_)
    for j in range(1, rows - 1):
        for i in range(1, columns - 1):
            if left[j, i] < np.inf:
                _wake(waiting, left, fixed, j, i)
    order, quiet = 0, 0
    while quiet < 4:
        quiet += 1
        for b in range(1, rows - 1):
            j = b if order < 2 else rows - 1 - b
            for a in range(1, columns - 1):
                i = a if order % 2 == 0 else columns - 1 - a
                if waiting[j, i]:
                    waiting[j, i] = False
                    value = _from_neighbours(left, j, i, weight[j, i] * cell * _slowness(lacking[j, i], spare, soft))
                    if value < left[j, i] - SETTLED:
                        left[j, i] = value
                        _wake(waiting, left, fixed, j, i)
                        quiet = 0
        order = (order + 1) % 4


@exact
def _wake(waiting, left, fixed, j, i):
    for nj in range(j - 1, j + 2):
        for ni in range(i - 1, i + 2):
            if not fixed[nj, ni] and left[nj, ni] > left[j, i]:
                waiting[nj, ni] = True


@exact
def _from_neighbours(left, j, i, cost):
    """The least of the 8 triangles of a node, one axis neighbour and one diagonal neighbour each.

    min over 0 <= s <= 1 of (1 - s) T_axis + s T_diagonal + cost sqrt(1 + s^2), with cost = w cell: the way through the
    point between the two. With d = (T_axis - T_diagonal) / cost it is T_axis + cost sqrt(1 - d^2) for d in
    (0, 1 / sqrt 2), and that of a neighbour alone otherwise.
    """
    best = left[j, i]
    for k in range(4):
        dj, di = (0, 1, 0, -1)[k], (1, 0, -1, 0)[k]
        axis = left[j + dj, i + di]
        best = min(best, axis + cost)
        for side in (-1, 1):
            diagonal = left[j + dj + side * di, i + di + side * dj]
            if diagonal >= best or diagonal == np.inf:
                continue
            best = min(best, diagonal + sqrt(2.0) * cost)
            d = (axis - diagonal) / cost
            if 0.0 < d < sqrt(0.5):
                best = min(best, axis + cost * np.sqrt(1.0 - d * d))
    return best


@exact
def _leave(left, lacking, cell, spare):
    """At the nodes without room: the way from the nearest node with room and OUTSIDE times the distance to it.

    The nearest nodes are handed on from node to node (Danielsson 1980). On a floor without any room nothing changes.
    """
    rows, columns = left.shape
    nearest = np.full((rows, columns, 2), -1, np.int64)
    for j in range(1, rows - 1):
        for i in range(1, columns - 1):
            if lacking[j, i] <= spare:
                nearest[j, i, 0], nearest[j, i, 1] = j, i
    changed, order = True, 0
    while changed or order % 4:
        changed = changed and order % 4 > 0
        for b in range(1, rows - 1):
            j = b if order % 4 < 2 else rows - 1 - b
            for a in range(1, columns - 1):
                i = a if order % 2 == 0 else columns - 1 - a
                if lacking[j, i] > spare:
                    changed |= _hand_on(nearest, left, j, i)
        order += 1
    for j in range(1, rows - 1):
        for i in range(1, columns - 1):
            nj, ni = nearest[j, i]
            if lacking[j, i] > spare and nj >= 0:
                left[j, i] = left[nj, ni] + OUTSIDE * cell * np.sqrt(float((nj - j) ** 2 + (ni - i) ** 2))


@exact
def _hand_on(nearest, left, j, i):
    """Whether a neighbour's nearest node is nearer than this node's, or as near with less way left; takes it."""
    changed = False
    for dj in range(-1, 2):
        for di in range(-1, 2):
            nj, ni = nearest[j + dj, i + di]
            if nj >= 0:
                oj, oi = nearest[j, i]
                new, old = (nj - j) ** 2 + (ni - i) ** 2, (oj - j) ** 2 + (oi - i) ** 2
                if oj < 0 or new < old or (new == old and left[nj, ni] < left[oj, oi]):
                    nearest[j, i, 0], nearest[j, i, 1] = nj, ni
                    changed = True
    return changed


# ------------------------------------------------------------------------------------------- way left


CELL = 0.1  # [m]; more where a floor has more than MAX_CELLS, less for a disc of a radius below it
MAX_CELLS = 1000  # along each axis
NOTHING = FieldGrid(np.zeros((0, 0)), 0.0, 0.0, 1.0)
LONGEST = 1000.0  # [m] of a way that is drawn
MARGIN = 3  # [cells] around the places where the disc touches a body


@dataclass(frozen=True, slots=True)
class WayField(Constant):
    """The way left to one goal, made once and looked up often."""

    grid: WayGrid

    @classmethod
    def of(
        cls,
        floor: Floor,
        goal: ArrayLike,
        radius: float,
        points: ArrayLike = (),
        cell: float = CELL,
        soft: float = 0.0,
        unseen: FieldGrid = NOTHING,
        factor: float = 1.0,
    ) -> "WayField":
        """Of a disc of `radius` [m] to `goal` (2,), with nodes `cell` [m] apart around bodies and `points` (k, 2).

        Where it can the way keeps `soft` [m] clear of bodies: as a way beside them costs up to TIGHT times its length.
        One over what is `unseen`, 1 there and 0 elsewhere, costs `factor` times its length.
        """
        gx, gy = (float(v) for v in np.asarray(goal, float))
        bounds = floor.bounds
        if bounds is None:
            return cls(WayGrid(np.zeros((0, 0)), gx, gy, cell, gx, gy))
        cell = min(cell, 0.75 * radius)  # a wall that the disc cannot pass is then wider than a cell's diagonal
        wide = radius + soft
        ends = np.concatenate([[[gx, gy]], bounds[0][None] - wide, bounds[1][None] + wide, rows_of(points)])
        low, high = ends.min(axis=0) - MARGIN * cell, ends.max(axis=0) + MARGIN * cell
        cell = max(cell, float((high - low).max()) / (MAX_CELLS - 1))
        columns, rows = (ceil(side / cell) + 1 for side in high - low)
        low -= 0.5 * (
            cell * np.array([columns - 1, rows - 1]) - (high - low)
        )  # the nodes of a mirrored floor are mirrored
        grid = WayGrid(np.empty((rows, columns)), float(low[0]), float(low[1]), cell, gx, gy)
        bodies = np.ascontiguousarray(floor.discs), np.ascontiguousarray(floor.boxes)
        solve(grid, float(radius), float(soft), *bodies, unseen, float(factor))
        return cls(grid)

    def way_left(self, points: ArrayLike) -> Array:
        """From each of `points` (n, 2) to the goal [m], (n,)."""
        return _looked_up(rows_of(points), self.grid)[:, 0].copy()

    def direction(self, points: ArrayLike) -> Array:
        """The unit vector along which the way goes on from each of `points` (n, 2), (n, 2).

        That is -grad T of the interpolation, which jumps at the sides of a cell; straight to the goal where the way is
        open; 0 at the goal.
        """
        return _downhill(_looked_up(rows_of(points), self.grid))

    def followed(self, start: ArrayLike, step: float) -> Array:
        """The way from `start` (2,) to the goal in steps of `step` [m], (n, 2); it ends where it leads nowhere."""
        points, found = [np.array(start, float)], _looked_up(rows_of(start), self.grid)
        while found[0, 0] > step and len(points) * step < LONGEST:
            at, before = points[-1] + step * _downhill(found)[0], found[0, 0]
            found = _looked_up(rows_of(at), self.grid)
            if found[0, 0] >= before:
                return np.array(points)
            points.append(at)
        return np.array([*points, [self.grid.goal_x, self.grid.goal_y]])


def _downhill(found: Array) -> Array:
    """The unit vectors against the gradients of `_looked_up` rows (n, 3), (n, 2); 0 where there is no slope."""
    slope = found[:, 1:]
    size = np.linalg.norm(slope, axis=1, keepdims=True)
    return -slope / np.where(size > 0.0, size, 1.0)


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
