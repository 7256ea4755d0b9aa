"""Which returns of a scan the map explains.

A return p on a surface that the map has lies at the distance c(p) = 0 from it. By the range's spread s along the beam
u, and by the robot's covariance P, whose pose q moves p by J dq, that distance has the variance

    (s n.u)^2 + (J^T n)^T P (J^T n),     n = grad c,     J = [I, (-(p_y - q_y), p_x - q_x)]

The map explains a return with |c| <= TOLERANCE + GATE standard deviations. The tolerance is for the map itself: what it
has may stand a little elsewhere, and its field is read between the nodes of a grid.
"""

import numpy as np

from mjnav.geometry.compiled import kernel
from mjnav.geometry.distance_field import lookup

TOLERANCE = 0.05  # [m]
GATE = 3.0  # standard deviations
MIN_STD = 0.001  # [m]
MIN_STEP = 0.02  # [m] of sphere tracing
SILENT, NOTHING, EXPLAINED, NEW = -1, 0, 1, 2  # a beam that says nothing; one that met nothing; returns


@kernel
def beyond_map(rays, beam, distance, pose, covariance, grid):
    """How many standard deviations a return would be beyond the tolerance of the map, at a `distance` along a beam."""
    ux, uy = rays.directions[beam, 0], rays.directions[beam, 1]
    x, y = rays.origins[beam, 0] + distance * ux, rays.origins[beam, 1] + distance * uy
    clearance, nx, ny = lookup(grid, x, y)
    lever = ny * (x - pose[0]) - nx * (y - pose[1])
    along = rays.spread[beam] * (nx * ux + ny * uy)
    variance = along * along + (
        nx * (nx * covariance[0, 0] + 2.0 * (ny * covariance[0, 1] + lever * covariance[0, 2]))
        + ny * (ny * covariance[1, 1] + 2.0 * lever * covariance[1, 2])
        + lever * lever * covariance[2, 2]
    )
    return max(abs(clearance) - TOLERANCE, 0.0) / np.sqrt(max(variance, MIN_STD * MIN_STD))


@kernel
def explained(rays, pose, covariance, grid):
    """What the map says to each beam, (B,): SILENT, NOTHING, EXPLAINED or NEW.

    Also how many standard deviations the return is beyond the tolerance, (B,), 0 where there is none. pose (3,) and
    covariance (3, 3): of the robot; grid: of the map's distance field.
    """
    num = len(rays.ranges)
    states, excess = np.zeros(num, np.int64), np.zeros(num)
    for i in range(num):
        distance = rays.ranges[i]
        if not (distance >= rays.min_range):
            states[i] = SILENT
            continue
        if distance > rays.max_range:
            states[i] = NOTHING
            continue
        excess[i] = beyond_map(rays, i, distance, pose, covariance, grid)
        states[i] = NEW if excess[i] > GATE else EXPLAINED
    return states, excess


@kernel
def meets_map(rays, beam, grid, end, margin, spread):
    """Whether a beam passes a surface of the map within `end` [m], at most `margin` [m] + `spread` times its way away.

    Sphere tracing (Hart 1996): from a point with the clearance c the beam is free for c.
    """
    along = rays.min_range
    while along < end:
        x = rays.origins[beam, 0] + along * rays.directions[beam, 0]
        y = rays.origins[beam, 1] + along * rays.directions[beam, 1]
        clearance = lookup(grid, x, y)[0]
        beside = margin + spread * along
        if clearance < beside:
            return True
        along += max(clearance - beside, MIN_STEP)
    return False
