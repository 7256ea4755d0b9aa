"""Shortest ways of a round body between bodies at rest.

A disc of radius r keeps clear of a body where its centre stays out of the body grown by r. The shortest way between two
points is then a chain of straight lines that bend around grown bodies only (Lozano-Perez and Wesley 1979). A grown
body is round at its corners; here a polygon stands around it, at most EXCESS away, whose corners the way may bend at.
So a way is the shortest one to within a few times EXCESS, and never leaves the free floor: each of its lines is tested
against the bodies themselves. A line from corner to corner belongs to a shortest way only if it is tangent to both
polygons, of which few are: the others are left out.
"""

from collections.abc import Sequence
from math import acos, ceil, cos, pi

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Indices, Matrix, Vector, exact
from mjnav.constant import Constant
from mjnav.geometry.floor import TOUCH, Floor, is_open, surface
from mjnav.messages import Array

EXCESS = 0.02  # [m] of a corner beyond the round edge that it stands for
_PUSHES = 16


class WayMap(Constant):
    """The ways of discs of one radius on one floor: corners, and which of them see one another."""

    def __init__(self, floor: Floor, reach: float, excess: float = EXCESS):
        """`reach` [m] is the least distance of a disc's centre from every body."""
        self.floor, self.reach = floor, reach
        hulls = [*_around_discs(floor, reach, excess), *_around_boxes(floor, reach, excess)]
        empty = np.zeros((0, 2))
        corners = np.concatenate([*hulls, empty])
        before = np.concatenate([*(np.roll(hull, 1, axis=0) for hull in hulls), empty])
        after = np.concatenate([*(np.roll(hull, -1, axis=0) for hull in hulls), empty])
        free = floor.clearance(corners) >= reach - TOUCH
        self.corners = np.ascontiguousarray(corners[free])  # (C, 2) [m]
        self._sides = np.ascontiguousarray(np.hstack([before[free], after[free]]))  # (C, 4): the neighbours' places
        one, other, lengths = _tangents(self.corners, self._sides, reach, floor.discs, floor.boxes)
        rows, columns = np.concatenate([one, other]), np.concatenate([other, one])
        order = np.argsort(rows, kind="stable")
        first = np.searchsorted(rows[order], np.arange(len(self.corners) + 1))
        self._edges = (
            first,
            columns[order],
            np.concatenate([lengths, lengths])[order],
        )  # corner i: first[i]:first[i + 1]

    def anchor(self, point: ArrayLike) -> Array | None:
        """A free place for the disc at or near a point (2,), out of the bodies it would overlap there; or None."""
        x, y = _pushed_out(*np.asarray(point, float).tolist(), self.reach, self.floor.discs, self.floor.boxes)
        return np.array([x, y]) if np.isfinite(x) else None

    def distances(self, goal: ArrayLike) -> Array:
        """(C,) [m] from each corner along the shortest way to a free place `goal` (2,); inf without a way."""
        goal = np.ascontiguousarray(goal, dtype=float)
        left = _seen_from(goal, self.corners, self._sides, self.reach, self.floor.discs, self.floor.boxes)
        _spread(left, *self._edges)
        return left

    def next_point(self, position: ArrayLike, goal: ArrayLike, distances: Array) -> Array | None:
        """Where to walk straight to from a position (2,) on the shortest way to a goal whose `distances` are given.

        That is the goal itself where the line to it is open, else the open corner with the least way left.
        """
        position, goal = (np.ascontiguousarray(p, float) for p in (position, goal))
        found = _next(position, goal, self.reach, self.corners, distances, self.floor.discs, self.floor.boxes)
        if found == len(self.corners):
            return goal
        return None if found < 0 else self.corners[found]

    def way(self, start: ArrayLike, goal: ArrayLike) -> Array | None:
        """The points of the shortest way from `start` to a free place `goal`, both (2,), after the start: (k, 2) [m].

        None where there is no way.
        """
        distances = self.distances(goal)
        points, position = [], np.asarray(start, float)
        goal = np.asarray(goal, float)
        while len(points) <= len(self.corners):
            following = self.next_point(position, goal, distances)
            if following is None:
                return None
            points.append(following)
            if np.array_equal(following, goal):
                return np.array(points)
            position = following
        return None


def _around_discs(floor: Floor, reach: float, excess: float) -> Sequence[Array]:
    """Regular polygons around the grown discs, counter-clockwise, (k, 2) each."""
    hulls = []
    for x, y, radius in floor.discs:
        num, out = _polygon(radius + reach, excess, 2.0 * pi)
        angles = 2.0 * pi / num * (np.arange(num) + 0.5)
        hulls.append(np.stack([x + out * np.cos(angles), y + out * np.sin(angles)], axis=1))
    return hulls


def _around_boxes(floor: Floor, reach: float, excess: float) -> Sequence[Array]:
    """Boxes grown by `reach` with cut corners, counter-clockwise, (k, 2) each."""
    num, out = _polygon(reach, excess, 0.5 * pi)
    angles = 0.5 * pi / num * (np.arange(num) + 0.5)
    quarter = out * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    hulls = []
    for x, y, ux, uy, half_length, half_thickness in floor.boxes:
        local = []
        for k, (sx, sy) in enumerate(((1, 1), (-1, 1), (-1, -1), (1, -1))):
            c, s = ((1, 0), (0, 1), (-1, 0), (0, -1))[k]
            turned = quarter @ np.array([[c, s], [-s, c]])
            local.append(turned + np.array([sx * half_length, sy * half_thickness]))
        hulls.append(np.array([x, y]) + np.concatenate(local) @ np.array([[ux, uy], [-uy, ux]]))
    return hulls


def _polygon(radius: float, excess: float, angle: float) -> tuple[int, float]:
    """How many corners a tangent polygon needs around an arc of `angle`, and their distance from its centre [m]."""
    num = max(ceil(angle / (2.0 * acos(radius / (radius + excess)))), ceil(angle / (0.5 * pi)))
    return num, radius / cos(0.5 * angle / num)


@exact
def _is_tangent(x, y, corner_x, corner_y, sides):
    """Whether the line from a point to a corner leaves the corner's polygon on one side."""
    dx, dy = corner_x - x, corner_y - y
    one = dx * (sides[1] - corner_y) - dy * (sides[0] - corner_x)
    other = dx * (sides[3] - corner_y) - dy * (sides[2] - corner_x)
    slack = TOUCH * (1.0 + abs(dx) + abs(dy))
    return (one >= -slack and other >= -slack) or (one <= slack and other <= slack)


@exact
def _tangents(corners: Matrix, sides: Matrix, reach: float, discs: Matrix, boxes: Matrix):
    """Pairs of corners that see one another along a common tangent: both indices and the distance [m]."""
    rows, columns, lengths = [0 for _ in range(0)], [0 for _ in range(0)], [0.0 for _ in range(0)]
    for i in range(len(corners)):
        x, y = corners[i, 0], corners[i, 1]
        for j in range(i):
            u, v = corners[j, 0], corners[j, 1]
            if (
                _is_tangent(x, y, u, v, sides[j])
                and _is_tangent(u, v, x, y, sides[i])
                and is_open(x, y, u, v, reach, discs, boxes)
            ):
                rows.append(i)
                columns.append(j)
                lengths.append(np.sqrt((u - x) ** 2 + (v - y) ** 2))
    return np.array(rows, np.int64), np.array(columns, np.int64), np.array(lengths, np.float64)


@exact
def _seen_from(point: Vector, corners: Matrix, sides: Matrix, reach: float, discs: Matrix, boxes: Matrix):
    """Distance [m] of each corner that a point sees along a tangent; inf of the others."""
    found = np.full(len(corners), np.inf)
    x, y = point[0], point[1]
    for j in range(len(corners)):
        u, v = corners[j, 0], corners[j, 1]
        if _is_tangent(x, y, u, v, sides[j]) and is_open(x, y, u, v, reach, discs, boxes):
            found[j] = np.sqrt((u - x) ** 2 + (v - y) ** 2)
    return found


@exact
def _spread(left: Vector, first: Indices, columns: Indices, lengths: Vector):
    """From the ways left of corners that see the goal to those of all corners, in place (Dijkstra 1959)."""
    done = np.zeros(len(left), np.bool_)
    for _ in range(len(left)):
        nearest = -1
        for i in range(len(left)):
            if not done[i] and left[i] < np.inf and (nearest < 0 or left[i] < left[nearest]):
                nearest = i
        if nearest < 0:
            return
        done[nearest] = True
        for k in range(first[nearest], first[nearest + 1]):
            left[columns[k]] = min(left[columns[k]], left[nearest] + lengths[k])


@exact
def _next(
    position: Vector, goal: Vector, reach: float, corners: Matrix, distances: Vector, discs: Matrix, boxes: Matrix
):
    """Index of the open corner with the least way left, the number of corners for the goal itself, -1 for none."""
    x, y = position[0], position[1]
    num = len(corners)
    if is_open(x, y, goal[0], goal[1], reach, discs, boxes):
        return num
    left = np.empty(num)
    for j in range(num):
        straight = np.sqrt((corners[j, 0] - x) ** 2 + (corners[j, 1] - y) ** 2)
        left[j] = straight + distances[j] if straight > TOUCH else np.inf
    while True:
        best = -1
        for j in range(num):
            if left[j] < np.inf and (best < 0 or left[j] < left[best]):
                best = j
        if best < 0 or is_open(x, y, corners[best, 0], corners[best, 1], reach, discs, boxes):
            return best
        left[best] = np.inf


@exact
def _pushed_out(x: float, y: float, reach: float, discs: Matrix, boxes: Matrix):
    """A point moved away from whatever is nearer than `reach` until nothing is; NaN where it does not end."""
    for _ in range(_PUSHES):
        nearest, away_x, away_y = surface(x, y, discs, boxes)
        if nearest >= reach - TOUCH:
            return x, y
        x, y = x + (reach - nearest) * away_x, y + (reach - nearest) * away_y
    return np.nan, np.nan
