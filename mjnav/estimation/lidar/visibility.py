"""How much of a disc a scan could have seen.

A beam u from o reaches a disc of radius R about c at the lateral offset a = u x (c - o), |a| <= R, after

    t = u.(c - o) - sqrt(R^2 - a^2)

It stands for all lines of sight within half a step of it, t step / 2 to both sides. It could see the disc where t is
within its range, and where it did not end before the disc: at t - SAME R - 3 sigma at most. What is nearer by less is
the disc itself, which stands elsewhere than was thought. A return from where the map has a surface would have been
explained by it, so that beam could not have shown the disc: of somebody at a wall, only what stands out is seen.
"""

import numpy as np

from mjnav.estimation.lidar.explained import GATE, beyond_map, meets_map
from mjnav.estimation.lidar.rays import Rays
from mjnav.geometry.compiled import exact
from mjnav.geometry.distance_field import FieldGrid
from mjnav.geometry.kernel_types import Matrix, Vector

SAME = 0.5  # share of the radius by which a disc's own returns may be nearer than its surface was thought to be
SIGMAS = 3.0
LOST = 0.9  # share of the range within which a surface of the map would surely have returned a beam


@exact
def visible_share(rays: Rays, points: Matrix, radius: float, pose: Vector, covariance: Matrix, grid: FieldGrid):
    """The share of the silhouettes of discs at `points` (n, 2) with one radius [m] that the scan could see, (n,).

    pose (3,) and covariance (3, 3): of the robot; grid: of the map's distance field.
    """
    shares = np.zeros(len(points))
    for p in range(len(points)):
        for i in range(len(rays.ranges)):
            distance = rays.ranges[i]
            if not distance >= rays.min_range:
                continue
            ux, uy = rays.directions[i, 0], rays.directions[i, 1]
            dx, dy = points[p, 0] - rays.origins[i, 0], points[p, 1] - rays.origins[i, 1]
            ahead, offset = ux * dx + uy * dy, abs(ux * dy - uy * dx)
            if ahead <= 0.0:
                continue
            half = 0.5 * ahead * rays.step
            overlap = min(offset + half, radius) - max(offset - half, -radius)
            if overlap <= 0.0:
                continue
            enter = ahead - np.sqrt(max(radius * radius - offset * offset, 0.0))
            if not rays.min_range <= enter <= rays.max_range:
                continue
            if distance < enter - SAME * radius - SIGMAS * rays.spread[i]:
                continue
            if distance > rays.max_range and meets_map(rays, i, grid, LOST * rays.max_range, 0.0, 0.0):
                continue
            if beyond_map(rays, i, enter, pose, covariance, grid) <= GATE:
                continue
            shares[p] += overlap / (2.0 * radius)
        shares[p] = min(shares[p], 1.0)
    return shares
