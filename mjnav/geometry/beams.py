"""What beams meet on a floor."""

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, exact
from mjnav.geometry.floor import ROUNDING, box_distance


@exact
def cast(origin: Vector, angles: Vector, discs: Matrix, boxes: Matrix, max_range: float):
    """Distance along each beam to the first disc or box, inf beyond `max_range`.

    origin (2,); angles (B,) in the world; discs (n, 3) x, y, radius; boxes (m, 6) as in `FloorPlan`. Returns (B,) [m].
    A disc or a box around the origin is met from the inside.

    Disc: with c from the origin to its centre and u along the beam, t = c.u -+ sqrt((c.u)^2 - |c|^2 + r^2).
    Box: the slab method in its own axes. Of many boxes, those beyond `max_range` are left out first.
    """
    within = np.empty_like(boxes)
    num_within = 0
    for j in range(len(boxes)):
        if not box_distance(origin[0], origin[1], boxes[j]) > max_range + ROUNDING:
            for c in range(boxes.shape[1]):
                within[num_within, c] = boxes[j, c]
            num_within += 1
    boxes = within[:num_within]
    ranges = np.full(len(angles), np.inf)
    for i in range(len(angles)):
        ux, uy = np.cos(angles[i]), np.sin(angles[i])
        nearest = np.inf
        for j in range(len(discs)):
            cx, cy = discs[j, 0] - origin[0], discs[j, 1] - origin[1]
            ahead = cx * ux + cy * uy
            excess = cx * cx + cy * cy - discs[j, 2] ** 2
            root = ahead * ahead - excess
            if root >= 0.0:
                t = ahead - np.sqrt(root) if excess > 0.0 else ahead + np.sqrt(root)
                if 0.0 <= t < nearest:
                    nearest = t
        for j in range(len(boxes)):
            cx, cy = boxes[j, 0] - origin[0], boxes[j, 1] - origin[1]
            ax, ay = boxes[j, 2], boxes[j, 3]
            enter, leave = -np.inf, np.inf
            for axis in range(2):
                if axis == 0:
                    centre, slope, half = cx * ax + cy * ay, ux * ax + uy * ay, boxes[j, 4]
                else:
                    centre, slope, half = cy * ax - cx * ay, uy * ax - ux * ay, boxes[j, 5]
                if abs(slope) < 1e-12:
                    if abs(centre) > half:
                        leave = -np.inf
                else:
                    first, second = (centre - half) / slope, (centre + half) / slope
                    enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
            t = enter if enter >= 0.0 else leave
            if enter <= leave and 0.0 <= t < nearest:
                nearest = t
        if nearest <= max_range:
            ranges[i] = nearest
    return ranges
