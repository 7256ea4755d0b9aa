"""The velocity nearest to a preferred one that obeys half-planes, or violates them least.

    V* = argmin |V - V_pref|   subject to   n_i . V >= c_i,  i = 1 ... n,   low <= V <= high.            (1)

The half-planes are added one by one: where the best so far violates a new one, the new best lies on its line, which
leaves a problem in one dimension. Where (1) has no solution, the largest violation is made as small as it can be,

    d* = min d   subject to   n_i . V + d >= c_i,   d >= 0,   low <= V <= high,                          (2)

likewise one dimension higher: where the best so far violates constraint i by more than d, the new best lies on its
plane d = c_i - n_i . V. Of all V that reach d* the nearest to V_pref is taken. Source: van den Berg, Guy, Lin & Manocha
(2011), "Reciprocal n-Body Collision Avoidance", section 5; the incremental programme: de Berg et al., "Computational
Geometry", chapter 4. The random order there is for the expected time only; here the order is the one given.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array

ROUNDING = 1e-10  # [m/s] of violation that is none
PARALLEL = 1e-12  # sine of the angle below which two lines are parallel
SLACK = 1e-9  # [m/s] on top of d*, so that (1) with d* has a solution in spite of rounding


@kernel
def _on_line(planes, num, nx, ny, c, box, x, y, gx, gy):
    """The best point of the line n . V = c within the first `num` planes and the box: (found, x, y).

    The nearest to (x, y) where the direction g is 0, else the farthest along g.
    """
    gap = c - (nx * x + ny * y)
    x, y = x + gap * nx, y + gap * ny
    tx, ty = -ny, nx
    low, high = -np.inf, np.inf
    for j in range(num + 4):
        if j < num:
            along = planes[j, 0] * tx + planes[j, 1] * ty
            missing = planes[j, 2] - (planes[j, 0] * x + planes[j, 1] * y)
        elif j < num + 2:
            along, missing = (tx, box[0] - x) if j == num else (-tx, x - box[2])
        else:
            along, missing = (ty, box[1] - y) if j == num + 2 else (-ty, y - box[3])
        if along > PARALLEL:
            low = max(low, missing / along)
        elif along < -PARALLEL:
            high = min(high, missing / along)
        elif missing > ROUNDING:
            return False, x, y
    if low > high + ROUNDING:
        return False, x, y
    direction = gx * tx + gy * ty
    t = high if direction > 0.0 else low if direction < 0.0 else min(max(0.0, low), high)
    x, y = x + t * tx, y + t * ty
    return True, min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])


@kernel
def _in_plane(planes, num, box, x, y, gx, gy):
    """(found, x, y) of problem (1) with the first `num` planes; farthest along g where that is not 0."""
    tx, ty = x, y
    x, y = min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])
    if gx != 0.0:
        x = box[2] if gx > 0.0 else box[0]
    if gy != 0.0:
        y = box[3] if gy > 0.0 else box[1]
    for i in range(num):
        if planes[i, 0] * x + planes[i, 1] * y < planes[i, 2] - ROUNDING:
            found, x, y = _on_line(planes, i, planes[i, 0], planes[i, 1], planes[i, 2], box, tx, ty, gx, gy)
            if not found:
                return False, tx, ty
    return True, x, y


@kernel
def _least_violation(planes, num, box, x, y):
    """(V, d*) of problem (2); d* is the largest violation at V."""
    x, y = min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])
    d = 0.0
    level = np.empty((num + 1, 3))
    for i in range(num):
        nx, ny, c = planes[i, 0], planes[i, 1], planes[i, 2]
        if c - (nx * x + ny * y) <= d + ROUNDING:
            continue
        # On plane i every other constraint leaves n_j . V - c_j >= n_i . V - c_i, and d >= 0 the far side of line i.
        level[0, 0], level[0, 1], level[0, 2] = -nx, -ny, -c
        count = 1
        for j in range(i):
            ax, ay = planes[j, 0] - nx, planes[j, 1] - ny
            size = np.sqrt(ax * ax + ay * ay)
            if size > PARALLEL:
                level[count, 0], level[count, 1], level[count, 2] = ax / size, ay / size, (planes[j, 2] - c) / size
                count += 1
        found, px, py = _in_plane(level, count, box, x, y, nx, ny)
        if found:
            x, y = px, py
        d = c - (nx * x + ny * y)
    for i in range(num):
        d = max(d, planes[i, 2] - (planes[i, 0] * x + planes[i, 1] * y))
    return x, y, d


@kernel
def _nearest(planes: Matrix, box: Vector, target: Vector):
    num = planes.shape[0]
    found, x, y = _in_plane(planes, num, box, target[0], target[1], 0.0, 0.0)
    if found:
        return x, y, 0.0
    sx, sy, d = _least_violation(planes, num, box, target[0], target[1])
    relaxed = planes.copy()
    for i in range(num):
        relaxed[i, 2] -= d + SLACK
    found, x, y = _in_plane(relaxed, num, box, target[0], target[1], 0.0, 0.0)
    return (x, y, d) if found else (sx, sy, d)


def nearest_velocity(
    normal: ArrayLike, offset: ArrayLike, low: ArrayLike, high: ArrayLike, preferred: ArrayLike
) -> tuple[Array, float]:
    """V* (2,) and d* [m/s], 0 where every half-plane is obeyed.

    Unit normals n (n, 2), offsets c (n,) [m/s]; the box low <= V <= high, (2,) each with low <= high, is always kept.
    """
    planes = np.column_stack([np.reshape(normal, (-1, 2)), np.reshape(offset, -1)]).astype(float)
    box = np.array([*np.asarray(low, float), *np.asarray(high, float)])
    x, y, d = _nearest(np.ascontiguousarray(planes), box, np.asarray(preferred, float))
    return np.array([x, y]), d
