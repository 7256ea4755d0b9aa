"""Constraints of walls and lane boundaries: the clearance of a straight path, and the signed distance of a point.

The constraint of a wall is the least distance between the path of the next T seconds and the wall's segment:

    f = R^2 - min_{0 <= t <= T, 0 <= s <= 1} |p + t q - (a + s (b - a))|^2, safe where f <= 0.

Two segments that do not cross are nearest at one of their four ends (Ericson, "Real-Time Collision Detection", 2005).

A lane boundary is the line a x + b y + c = 0.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import kernel, scalar
from mjnav.errors import InvalidValue
from mjnav.messages import Array

TINY = 1e-300


@scalar
def point_to_segment(px, py, ax, ay, dx, dy):
    """Squared distance of p from the segment a + s d, s in [0, 1]."""
    x = px - ax
    y = py - ay
    s = min(max((x * dx + y * dy) / max(dx * dx + dy * dy, TINY), 0.0), 1.0)
    x -= s * dx
    y -= s * dy
    return x * x + y * y


@scalar
def wall_segment(px, py, qx, qy, ax, ay, bx, by, radius_squared, horizon):
    """f of one path p + t q, t in [0, horizon], and one wall a-b."""
    ux = horizon * qx
    uy = horizon * qy
    wx = bx - ax
    wy = by - ay
    ends = min(
        min(point_to_segment(px, py, ax, ay, wx, wy), point_to_segment(px + ux, py + uy, ax, ay, wx, wy)),
        min(point_to_segment(ax, ay, px, py, ux, uy), point_to_segment(bx, by, px, py, ux, uy)),
    )
    # They cross where each has its two ends on opposite sides of the other.
    a_side = ux * (ay - py) - uy * (ax - px)
    b_side = ux * (by - py) - uy * (bx - px)
    p_side = wx * (py - ay) - wy * (px - ax)
    end_side = wx * (py + uy - ay) - wy * (px + ux - ax)
    crosses = (a_side * b_side < 0.0) & (p_side * end_side < 0.0)
    return radius_squared - (0.0 if crosses else ends)


@kernel
def _wall(out, px, py, qx, qy, ax, ay, bx, by, radius, horizon):
    for i in range(out.size):
        out[i] = wall_segment(px[i], py[i], qx[i], qy[i], ax[i], ay[i], bx[i], by[i], radius[i] * radius[i], horizon)


def wall_clearance(
    position: ArrayLike, velocity: ArrayLike, start: ArrayLike, end: ArrayLike, radius: ArrayLike, horizon: float
) -> Array:
    """f [m^2] for positions and velocities (..., 2), walls from `start` to `end` (..., 2) and R (...); all broadcast.

    `horizon` [s] >= 0 is the length of the path looked at. Raises InvalidValue.
    """
    if not 0.0 <= horizon < np.inf:
        raise InvalidValue("horizon", horizon, "a finite number >= 0")
    arrays = [np.asarray(a, float) for a in (position, velocity, start, end)]
    for name, value in zip(("position", "velocity", "start", "end"), arrays, strict=True):
        if value.shape[-1:] != (2,):
            raise InvalidValue(name, value.shape, "an array whose last axis is 2")
    columns = [a[..., axis] for a in arrays for axis in (0, 1)]
    columns = np.broadcast_arrays(*columns, np.asarray(radius, float))
    out = np.empty(columns[0].shape)
    _wall(out.reshape(-1), *(np.array(c, order="C").reshape(-1) for c in columns), float(horizon))
    return out[()]


def lane_distance(position: ArrayLike, line: tuple[float, float, float]) -> Array:
    """d = (a x + b y + c) / sqrt(a^2 + b^2) [m] for positions (..., 2): (...). Left: d <= 0 is safe; right: d >= 0.

    Source: Nair et al., arXiv 2112.13034. Raises InvalidValue where a = b = 0, or
    where the last axis of the positions is not 2.
    """
    a, b, c = line
    norm = np.hypot(a, b)
    if not norm > 0.0:
        raise InvalidValue("line", line, "a line (a, b, c) with a or b other than 0")
    position = np.asarray(position, float)
    if position.shape[-1:] != (2,):
        raise InvalidValue("position", position.shape, "an array whose last axis is 2")
    return (a * position[..., 0] + b * position[..., 1] + c) / norm
