"""An error that all ranges of a scan share, told by the map.

A lidar that has come out of adjustment errs alike in all directions. Where most beams end on the map's surfaces, the
median over the beams of what they measured beyond the range on the map is that error: people and furniture that the map
does not have are few, and an error of the robot's pose makes ranges too long on one side and too short on the other.
"""

from math import sqrt

import numpy as np

from mjnav.estimation.lidar.rays import Rays
from mjnav.geometry.compiled import exact
from mjnav.geometry.distance_field import FieldGrid, lookup
from mjnav.messages import Array
from mjnav.scenarios.lidar import Lidar

BIN = 0.01  # [m] of the histogram of which the median is taken
REACH = 1.0  # [m] beyond which a difference is no error of the lidar
MIN_BEAMS = 30  # within REACH
MIN_INCIDENCE = 0.5  # cosine; at more slanting incidence a small error of the heading is a large one of the range
ALIKE = 10  # bins beside the median's, and the share of all beams that have to be in them: at a wrong pose few are
ALIKE_SHARE = 0.6
LEAST = 0.03  # [m] that is put right
SIGMAS = 3.0
CLOSE = 0.01  # [m] from a surface at which a beam has met it
MAX_STEPS = 60


@exact
def map_range(rays, beam, grid):
    """The range at which a beam meets the map [m], inf for none; and the cosine of its incidence there."""
    ux, uy = rays.directions[beam, 0], rays.directions[beam, 1]
    along = 0.0
    for _ in range(MAX_STEPS):
        clearance, nx, ny = lookup(grid, rays.origins[beam, 0] + along * ux, rays.origins[beam, 1] + along * uy)
        along += clearance
        if clearance < CLOSE:
            return along, abs(nx * ux + ny * uy)
        if along > rays.max_range:
            break
    return np.inf, 0.0


@exact
def shared_error(rays: Rays, grid: FieldGrid):
    """The median of the ranges measured less those on the map [m]; 0 where too few beams meet the map, or differ.

    Only of beams within REACH, which do not meet the map at slanting incidence.
    """
    num_bins = int(2.0 * REACH / BIN)
    counts, total, returns = np.zeros(num_bins, np.int64), 0, 0
    for i in range(len(rays.ranges)):
        if rays.min_range <= rays.ranges[i] <= rays.max_range:
            expected, incidence = map_range(rays, i, grid)
            difference = rays.ranges[i] - expected
            returns += expected == np.inf or incidence > MIN_INCIDENCE
            if incidence > MIN_INCIDENCE and abs(difference) < REACH:
                counts[min(int((difference + REACH) / BIN), num_bins - 1)] += 1
                total += 1
    if total < MIN_BEAMS:
        return 0.0
    middle, below = 0, counts[0]
    while 2 * below < total:
        middle += 1
        below += counts[middle]
    error = (middle + 0.5) * BIN - REACH
    alike = 0
    for k in range(max(middle - ALIKE, 0), min(middle + ALIKE + 1, num_bins)):
        alike += counts[k]
    return error if alike >= ALIKE_SHARE * returns else 0.0


def put_right(points: Array, lidar: Lidar, pose: Array, covariance: Array, grid: FieldGrid) -> Array:
    """A scan's points (B, 2) in the frame of the robot at `pose` (3,), with `covariance` (3, 3), without that error."""
    away = points - lidar.mount[:2]
    ranges = np.hypot(away[:, 0], away[:, 1])
    directions = away / np.maximum(ranges, CLOSE)[:, None]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    to_world = np.array([[c, s], [-s, c]])
    rays = Rays(
        origins=np.tile(lidar.mount[:2] @ to_world + pose[:2], (len(points), 1)),
        directions=np.ascontiguousarray(directions @ to_world),
        ranges=ranges,
        spread=np.zeros(0),
        times=np.zeros(0),
        step=0.0,
        width=0.0,
        closed=True,
        min_range=lidar.min_range,
        max_range=lidar.max_range,
    )
    error = beyond_doubt(shared_error(rays, grid), covariance)
    return points - error * directions if error else points


def beyond_doubt(error: float, covariance: Array) -> float:
    """The error [m], or 0 where the robot's uncertainty (3, 3) may explain it."""
    doubt = LEAST + SIGMAS * sqrt(max(covariance[0, 0], covariance[1, 1]))
    return error if abs(error) > doubt else 0.0
