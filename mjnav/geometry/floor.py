"""Bodies on a floor, from above, as discs and rectangles, and the free space that they leave for a round body.

A regular grid says which points of a floor a round body can go between. The clearance of a point changes by no more
than the point moves. A disc of radius r that moves straight between the centres of two neighbouring cells therefore
touches nothing where both clearances are at least r + half of the distance between them: only such cells count as free,
and no way through them is wrong. A gap that is narrower than 2 r + 2 cells may be missed. `shortest_way` is exact, and
takes longer the more bodies there are; a grid says for every place at once what is connected.
"""

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.compile.compiled import Matrix, exact
from mjnav.constant import Constant
from mjnav.messages import Array, KnownMap

# --------------------------------------------------------------------------------------------- bodies


TOUCH = 1e-9  # [m]; bodies nearer than this touch
ROUNDING = 1e-6  # [m], far more than what rounding changes in a distance


@dataclass(frozen=True, slots=True)
class Floor(Constant):
    """Bodies at rest."""

    discs: Array  # (n, 3) x, y, radius [m]
    boxes: Array  # (m, 6) centre x, y; unit vector along, x, y; half length, half thickness [m]

    @property
    def bounds(self) -> tuple[Array, Array] | None:
        """Lowest and highest x, y [m] of all bodies, (2,) each; None on an empty floor."""
        along, (length, thickness) = np.abs(self.boxes[:, 2:4]), self.boxes[:, 4:].T[:, :, None]
        reach = np.concatenate([np.tile(self.discs[:, 2:], 2), along * length + along[:, ::-1] * thickness])
        centre = np.concatenate([self.discs[:, :2], self.boxes[:, :2]])
        return ((centre - reach).min(axis=0), (centre + reach).max(axis=0)) if len(centre) else None

    def clearance(self, points: ArrayLike) -> Array:
        """From each of `points` (..., 2) to the nearest surface [m], negative inside a body; inf on an empty floor.

        A round body of radius r is free where the clearance of its centre is at least r.
        """
        return self.nearest(points)[0]

    def nearest(self, points: ArrayLike) -> tuple[Array, NDArray[np.int64]]:
        """The clearance of each of `points` (..., 2) and the body that is nearest: discs are counted first, then boxes.

        The first of those that are as near; -1 on an empty floor.
        """
        points = np.asarray(points, float)
        clearance, body = _nearest(np.ascontiguousarray(points.reshape(-1, 2)), self.discs, self.boxes)
        return clearance.reshape(points.shape[:-1]), body.reshape(points.shape[:-1])

    def blocking(self, start: ArrayLike, end: ArrayLike, reach: float) -> int | None:
        """The body that a disc of radius `reach` [m] meets first on its straight way from `start` to `end` (2,).

        Discs are counted first, then boxes; None where the way is free. The first is the one nearest to `start`.
        """
        (x0, y0), (x1, y1) = np.asarray(start, float), np.asarray(end, float)
        found = _blocking(x0, y0, x1, y1, reach, self.discs, self.boxes)
        return None if found < 0 else int(found)


def floor_of_map(known: KnownMap) -> Floor:
    """What the robot's map has: legs, then pillars, as discs; walls as boxes."""
    start, end = np.array(known.walls[:, 0]), np.array(known.walls[:, 1])
    length = np.hypot(*(end - start).T)
    along = (end - start) / length[:, None]
    boxes = np.column_stack([0.5 * (start + end), along, 0.5 * length, 0.5 * known.wall_thickness])
    return Floor(np.array(known.discs, order="C"), np.ascontiguousarray(boxes))


@exact
def box_distance(x, y, box):
    """From a point to a box as in `Floor.boxes` [m]; 0 inside it."""
    dx, dy = x - box[0], y - box[1]
    along = max(abs(dx * box[2] + dy * box[3]) - box[4], 0.0)
    across = max(abs(dy * box[2] - dx * box[3]) - box[5], 0.0)
    return np.sqrt(along * along + across * across)


@exact
def disc_surface(x, y, disc):
    """From a point to a disc's surface [m], negative inside, and the unit vector away from its centre."""
    dx, dy = x - disc[0], y - disc[1]
    length = np.sqrt(dx * dx + dy * dy)
    return (length - disc[2], dx / length, dy / length) if length > 0.0 else (-disc[2], 1.0, 0.0)


@exact
def box_surface(x, y, box):
    """From a point to a box's surface [m], negative inside, and the unit vector out of it by the shortest way."""
    dx, dy = x - box[0], y - box[1]
    ux, uy = box[2], box[3]
    u, v = dx * ux + dy * uy, dy * ux - dx * uy
    along, across = abs(u) - box[4], abs(v) - box[5]
    out_u, out_v = max(along, 0.0), max(across, 0.0)
    outside = np.sqrt(out_u * out_u + out_v * out_v)
    distance = outside + min(max(along, across), 0.0)
    if outside > 0.0:
        out_u, out_v = out_u / outside, out_v / outside
    elif along > across:
        out_u, out_v = 1.0, 0.0
    else:
        out_u, out_v = 0.0, 1.0
    out_u, out_v = out_u if u >= 0.0 else -out_u, out_v if v >= 0.0 else -out_v
    return distance, out_u * ux - out_v * uy, out_u * uy + out_v * ux


@exact
def surface(x, y, discs, boxes):
    """From a point to the nearest surface [m], negative inside, and the unit vector away from that body."""
    nearest, away_x, away_y = np.inf, 0.0, 0.0
    for j in range(len(discs)):
        distance, nx, ny = disc_surface(x, y, discs[j])
        if distance < nearest:
            nearest, away_x, away_y = distance, nx, ny
    for j in range(len(boxes)):
        distance, nx, ny = box_surface(x, y, boxes[j])
        if distance < nearest:
            nearest, away_x, away_y = distance, nx, ny
    return nearest, away_x, away_y


@exact
def point_segment(px, py, x0, y0, x1, y1):
    """Least distance [m] of a point from a segment."""
    dx, dy = x1 - x0, y1 - y0
    squared = dx * dx + dy * dy
    t = ((px - x0) * dx + (py - y0) * dy) / squared if squared > 0.0 else 0.0
    t = min(max(t, 0.0), 1.0)
    ox, oy = px - x0 - t * dx, py - y0 - t * dy
    return np.sqrt(ox * ox + oy * oy)


@exact
def segment_box(x0, y0, x1, y1, box):
    """Least distance [m] between a segment and a box, 0 where they meet."""
    ux, uy, a, b = box[2], box[3], box[4], box[5]
    p, q = (x0 - box[0]) * ux + (y0 - box[1]) * uy, (y0 - box[1]) * ux - (x0 - box[0]) * uy
    r, s = (x1 - box[0]) * ux + (y1 - box[1]) * uy, (y1 - box[1]) * ux - (x1 - box[0]) * uy
    # Clipped by the box's two pairs of sides (Liang and Barsky, 1984).
    enters, leaves = 0.0, 1.0
    for start, change, half in ((p, r - p, a), (q, s - q, b)):
        if change == 0.0:
            if abs(start) > half:
                leaves = -1.0
        else:
            first, second = (-half - start) / change, (half - start) / change
            enters, leaves = max(enters, min(first, second)), min(leaves, max(first, second))
    if enters <= leaves:
        return 0.0
    # Apart, the nearest pair has an end of the segment or a corner of the box.
    nearest = np.inf
    for x, y in ((p, q), (r, s)):
        out_x, out_y = max(abs(x) - a, 0.0), max(abs(y) - b, 0.0)
        nearest = min(nearest, np.sqrt(out_x * out_x + out_y * out_y))
    for x in (-a, a):
        for y in (-b, b):
            nearest = min(nearest, point_segment(x, y, p, q, r, s))
    return nearest


@exact
def is_open(x0, y0, x1, y1, reach, discs, boxes):
    """Whether a disc can walk straight: it comes no nearer to any body than touching, or than it is at the start."""
    length = np.sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    for j in range(len(discs)):
        now = np.sqrt((x0 - discs[j, 0]) ** 2 + (y0 - discs[j, 1]) ** 2) - discs[j, 2]
        if now - length < reach - TOUCH:
            closest = point_segment(discs[j, 0], discs[j, 1], x0, y0, x1, y1) - discs[j, 2]
            if closest < min(reach, now) - TOUCH:
                return False
    for j in range(len(boxes)):
        now = box_distance(x0, y0, boxes[j])
        if now - length < reach - TOUCH and segment_box(x0, y0, x1, y1, boxes[j]) < min(reach, now) - TOUCH:
            return False
    return True


_TOGETHER = 8  # neighbouring points, of rows of a grid or of a scan, that share what may be nearest


@exact
def _nearest(points: Matrix, discs: Matrix, boxes: Matrix):
    """Of points (n, 2): the clearance, (n,), and the body that is nearest, discs first, -1 on an empty floor, (n,).

    No body is farther from neighbours of x than the nearest one from x by more than twice what the neighbours are from
    x.
    """
    num_discs, num = len(discs), len(discs) + len(boxes)
    away, near = np.empty(num), np.empty(num, np.int64)
    clearance, body = np.full(len(points), np.inf), np.full(len(points), -1)
    for first in range(0, len(points), _TOGETHER):
        x, y, last = points[first, 0], points[first, 1], min(first + _TOGETHER, len(points))
        reach, nearest, num_near = 0.0, np.inf, 0
        for i in range(first, last):
            distance = np.sqrt((points[i, 0] - x) ** 2 + (points[i, 1] - y) ** 2)
            if distance > reach:  # a NaN is not
                reach = distance
        for j in range(num_discs):
            away[j] = disc_surface(x, y, discs[j])[0]
            nearest = min(nearest, away[j])
        for j in range(num_discs, num):
            away[j] = box_surface(x, y, boxes[j - num_discs])[0]
            nearest = min(nearest, away[j])
        for j in range(num):
            if not away[j] > nearest + 2.0 * reach + ROUNDING:
                near[num_near] = j
                num_near += 1
        for i in range(first, last):
            for j in near[:num_near]:
                if j < num_discs:
                    distance = disc_surface(points[i, 0], points[i, 1], discs[j])[0]
                else:
                    distance = box_surface(points[i, 0], points[i, 1], boxes[j - num_discs])[0]
                if distance < clearance[i]:
                    clearance[i], body[i] = distance, j
    return clearance, body


@exact
def _blocking(x0: float, y0: float, x1: float, y1: float, reach: float, discs: Matrix, boxes: Matrix):
    first, found = np.inf, -1
    for j in range(len(discs)):
        if point_segment(discs[j, 0], discs[j, 1], x0, y0, x1, y1) - discs[j, 2] < reach - TOUCH:
            distance = np.sqrt((x0 - discs[j, 0]) ** 2 + (y0 - discs[j, 1]) ** 2) - discs[j, 2]
            if distance < first:
                first, found = distance, j
    for j in range(len(boxes)):
        if segment_box(x0, y0, x1, y1, boxes[j]) < reach - TOUCH:
            distance = box_distance(x0, y0, boxes[j])
            if distance < first:
                first, found = distance, len(discs) + j
    return found


# ------------------------------------------------------------------------------- free space on a grid


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
        centres = np.empty((rows, columns, 2))
        centres[..., 0] = low[0] + cell * np.arange(columns)
        centres[..., 1] = (low[1] + cell * np.arange(rows))[:, None]
        return cls((float(low[0]), float(low[1])), cell, floor.clearance(centres))

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

        None if no point is cut off. Errs the other way than `connects`: a cell is free where the disc may have its
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
    """The parts of the cells within reach of a place, and that of the nearest one, 0 without a part; in cells."""
    first = np.maximum(np.ceil(place - reach), 0).astype(int)
    last = np.maximum(np.floor(place + reach) + 1, 0).astype(int)
    found = np.argwhere(parts[first[0] : last[0], first[1] : last[1]]) + first
    distance = np.hypot(*(found - place).T)
    if not len(found) or distance.min() > reach:
        return set(), 0
    numbers = parts[tuple(found.T)]
    return set(numbers[distance <= reach].tolist()), int(numbers[distance.argmin()])
