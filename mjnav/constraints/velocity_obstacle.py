"""The half-plane of velocities outside a velocity obstacle, as optimal reciprocal collision avoidance takes it.

With r the obstacle's position relative to the robot's, q the robot's velocity relative to the obstacle's, R the sum of
the radii and tau the time horizon,

    VO = {w : |t w - r| < R for some t in [0, tau]},   u = (nearest point of VO's boundary to q) - q,

a cone whose tip is cut off by the disc of radius R / tau about r / tau. With n the outward normal of VO at q + u and
alpha the share of the avoidance that the robot takes on itself, its own velocity is to obey

    n . (V - (V_now + alpha u)) >= 0.

Where the two overlap already, what is cut off is the disc of one control period in place of tau, so that they part
within one period. Source: van den Berg, Guy, Lin & Manocha (2011), "Reciprocal n-Body Collision Avoidance", equations
(3)-(7).
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue
from mjnav.geometry.compiled import kernel, scalar
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array

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

    Every relative velocity w with n . (w - q) >= n . u keeps clear of the obstacle for `horizon`. Raises InvalidValue.
    """
    for key, value in (("horizon", horizon), ("period", period)):
        if not 0.0 < value < np.inf:
            raise InvalidValue(key, value, "a finite number > 0")
    r, q = (np.ascontiguousarray(a, dtype=float).reshape(-1, 2) for a in (relative_position, relative_velocity))
    radius = np.ascontiguousarray(radius, dtype=float).reshape(-1)
    normal, depth = np.empty_like(r), np.empty(len(r))
    _leave(normal, depth, r, q, radius, float(horizon), float(period))
    return normal, depth
