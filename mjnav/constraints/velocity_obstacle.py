"""Half-planes of velocities outside velocity obstacles (ORCA), and the velocity nearest to a preferred one in them.

The half-plane of one obstacle is that of optimal reciprocal collision avoidance. With r the obstacle's position
relative to the robot's, q the robot's velocity relative to the obstacle's, R the sum of the radii and tau the time
horizon,

    VO = {w : |t w - r| < R for some t in [0, tau]},   u = (nearest point of VO's boundary to q) - q,

a cone whose tip is cut off by the disc of radius R / tau about r / tau. With n the outward normal of VO at q + u and
alpha the share of the avoidance that the robot takes on itself, its own velocity is to obey

    n . (V - (V_now + alpha u)) >= 0.

Where robot and obstacle overlap already, the disc is that of one control period in place of tau, so that they part
within one period. Source: van den Berg, Guy, Lin & Manocha (2011), "Reciprocal n-Body Collision Avoidance", equations
(3)-(7).

The velocity nearest to a preferred one that obeys n half-planes solves

    V* = argmin |V - V_pref|   subject to   n_i . V >= c_i,  i = 1 ... n,   low <= V <= high.            (1)

The box low <= V <= high bounds a robot's velocity; a disc |V| <= r in its place bounds a person's.

The half-planes are added one by one: where the best velocity so far violates a new one, the new best lies on its line,
which leaves a problem in one dimension. Where (1) has no solution, the largest violation is minimised,

    d* = min d   subject to   n_i . V + d >= c_i,   d >= 0,   low <= V <= high,                          (2)

by the same method one dimension higher: where the best velocity so far violates constraint i by more than d, the new
best lies on its plane d = c_i - n_i . V. Of all V that reach d* the nearest to V_pref is taken. The first half-planes
may be hard, those of walls: they hold in (2) as they are, without d. Source: van den Berg, Guy, Lin & Manocha (2011),
"Reciprocal n-Body Collision Avoidance", section 5; the incremental programme: de Berg et al., "Computational Geometry",
chapter 4. The random order in that programme serves the expected time only; here the order is the one given.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, Vector, kernel, scalar
from mjnav.messages import Array

# -------------------------------------------------------------------------- half-plane of an obstacle


TIE = 1e-9  # [rad] off the middle within which both sides of an obstacle are equally near


@scalar
def leave_velocity_obstacle(rx, ry, qx, qy, radius, horizon, period):
    """n and n . u of one obstacle: (nx, ny, depth). Inside VO the depth is positive."""
    rr = rx * rx + ry * ry
    overlap = rr <= radius * radius
    rate = 1.0 / (period if overlap else horizon)
    # w points from the centre of the disc that cuts the cone off to q.
    wx = qx - rate * rx
    wy = qy - rate * ry
    ww = wx * wx + wy * wy
    wr = wx * rx + wy * ry
    if overlap or (wr < 0.0 and wr * wr > radius * radius * ww):
        w = np.sqrt(ww)
        if w > 0.0:
            nx, ny = wx / w, wy / w
        else:  # straight away from the obstacle, or backwards where there is no such direction
            distance = np.sqrt(rr)
            nx, ny = (-rx / distance, -ry / distance) if distance > 0.0 else (-1.0, 0.0)
        return nx, ny, radius * rate - w
    # The tangents from the origin to the disc about r touch it at the end of a leg; the nearer leg counts, the
    # right one where both are equally near.
    leg = np.sqrt(rr - radius * radius)
    cross = rx * wy - ry * wx
    side = 1.0 if cross > 0.0 and cross * cross > TIE * TIE * rr * ww else -1.0
    dx = (rx * leg - side * ry * radius) / rr
    dy = (ry * leg + side * rx * radius) / rr
    nx, ny = -side * dy, side * dx
    return nx, ny, -(qx * nx + qy * ny)


@kernel
def _leave(normal: Matrix, depth: Vector, r: Matrix, q: Matrix, radius: Vector, horizon: float, period: float):
    for b in range(depth.size):
        normal[b, 0], normal[b, 1], depth[b] = leave_velocity_obstacle(
            r[b, 0], r[b, 1], q[b, 0], q[b, 1], radius[b], horizon, period
        )


def velocity_obstacle_exits(
    relative_position: ArrayLike, relative_velocity: ArrayLike, radius: ArrayLike, horizon: float, period: float
) -> tuple[Array, Array]:
    """n (B, 2) and n . u (B,) [m/s] for r and q (B, 2) and R (B,); `horizon` and `period` [s].

    Every relative velocity w with n . (w - q) >= n . u keeps clear of the obstacle for `horizon`.
    """
    r, q = (np.ascontiguousarray(a, dtype=float).reshape(-1, 2) for a in (relative_position, relative_velocity))
    radius = np.ascontiguousarray(radius, dtype=float).reshape(-1)
    normal, depth = np.empty_like(r), np.empty(len(r))
    _leave(normal, depth, r, q, radius, float(horizon), float(period))
    return normal, depth


# ----------------------------------------------------------------------------------- nearest velocity


ROUNDING = 1e-10  # [m/s] of violation that is none
PARALLEL = 1e-12  # sine of the angle below which two lines are parallel
SLACK = 1e-9  # [m/s] on top of d*, so that (1) with d* has a solution in spite of rounding


@kernel
def _on_line(planes, num, nx, ny, c, box, reach, x, y, gx, gy):
    """The best point of the line n . V = c within the first `num` planes, the box and the disc: (found, x, y).

    The nearest to (x, y) where the direction g is 0, else the farthest along g.
    """
    gap = c - (nx * x + ny * y)
    x, y = x + gap * nx, y + gap * ny
    tx, ty = -ny, nx
    low, high = -np.inf, np.inf
    if reach < np.inf:
        middle = -(x * tx + y * ty)
        square = middle * middle + reach * reach - (x * x + y * y)
        if square < -ROUNDING * reach:
            return False, x, y
        half = np.sqrt(max(square, 0.0))
        low, high = middle - half, middle + half
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
def _in_bounds(x, y, box, reach):
    """The nearest to (x, y) in the box and the disc, of which one bounds."""
    x, y = min(max(x, box[0]), box[2]), min(max(y, box[1]), box[3])
    size = np.sqrt(x * x + y * y)
    return (x * reach / size, y * reach / size) if size > reach else (x, y)


@kernel
def _in_plane(planes, num, box, reach, x, y, gx, gy):
    """(found, x, y) of problem (1) with the first `num` planes; farthest along g where that is not 0."""
    tx, ty = x, y
    x, y = _in_bounds(x, y, box, reach)
    if reach < np.inf:
        size = np.sqrt(gx * gx + gy * gy)
        if size > 0.0:
            x, y = gx * reach / size, gy * reach / size
    elif gx != 0.0:
        x = box[2] if gx > 0.0 else box[0]
    if gy != 0.0 and reach == np.inf:
        y = box[3] if gy > 0.0 else box[1]
    for i in range(num):
        if planes[i, 0] * x + planes[i, 1] * y < planes[i, 2] - ROUNDING:
            found, x, y = _on_line(planes, i, planes[i, 0], planes[i, 1], planes[i, 2], box, reach, tx, ty, gx, gy)
            if not found:
                return False, tx, ty
    return True, x, y


@kernel
def _least_violation(planes, num, hard, box, reach, x, y):
    """(V, d*) of problem (2), searched for from (x, y), which obeys the hard planes; d* is the violation at V."""
    d = 0.0
    level = np.empty((num + 1, 3))
    for i in range(hard, num):
        nx, ny, c = planes[i, 0], planes[i, 1], planes[i, 2]
        if c - (nx * x + ny * y) <= d + ROUNDING:
            continue
        # On plane i every other constraint leaves n_j . V - c_j >= n_i . V - c_i, and d >= 0 the far side of line i.
        level[0, 0], level[0, 1], level[0, 2] = -nx, -ny, -c
        count = 1
        for j in range(i):
            mx, my, e = planes[j, 0], planes[j, 1], planes[j, 2]
            if j >= hard:
                mx, my, e = mx - nx, my - ny, e - c
            size = np.sqrt(mx * mx + my * my)
            if size > PARALLEL:
                level[count, 0], level[count, 1], level[count, 2] = mx / size, my / size, e / size
                count += 1
        found, px, py = _in_plane(level, count, box, reach, x, y, nx, ny)
        if found:
            x, y = px, py
        d = c - (nx * x + ny * y)
    for i in range(hard, num):
        d = max(d, planes[i, 2] - (planes[i, 0] * x + planes[i, 1] * y))
    return x, y, d


@kernel
def nearest_within(planes, num, hard, box, reach, tx, ty):
    """(V*_x, V*_y, d*) for the first `num` of the planes (n, 3) n_x, n_y, c, and the target (tx, ty).

    The first `hard` planes are; they have a velocity in common, as 0 is for walls. Velocities are bounded by the box
    (4,) low, high or by the disc of radius `reach`: the other one is infinite. Where (1) has no solution, d* is taken
    from the offsets of the other planes in place.
    """
    count, sx, sy, d = num, tx, ty, 0.0
    for attempt in range(3):  # all planes; the hard ones alone, from where (2) is solved; all, relaxed by d*
        found, x, y = _in_plane(planes, count, box, reach, tx, ty, 0.0, 0.0)
        if attempt == 1:
            sx, sy, d = _least_violation(planes, num, hard, box, reach, x, y)
            count = num
            for i in range(hard, num):
                planes[i, 2] -= d + SLACK
        elif found:
            return x, y, d
        else:
            count = hard
    return sx, sy, d


@kernel
def _nearest(planes: Matrix, box: Vector, target: Vector):
    return nearest_within(planes, planes.shape[0], 0, box, np.inf, target[0], target[1])


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
