"""What stands on a floor, from above: discs and rectangles, and the room that they leave for a round body."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Matrix
from mjnav.messages import Array, KnownMap

TOUCH = 1e-9  # [m]; bodies nearer than this touch


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
        points = np.asarray(points, float)
        flat = np.ascontiguousarray(points.reshape(-1, 2))
        return _clearance(flat, self.discs, self.boxes).reshape(points.shape[:-1])

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


@exact
def _clearance(points: Matrix, discs: Matrix, boxes: Matrix):
    found = np.empty(len(points))
    for i in range(len(points)):
        found[i] = surface(points[i, 0], points[i, 1], discs, boxes)[0]
    return found


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
