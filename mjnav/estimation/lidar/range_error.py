"""An error that all ranges of a scan share, told by the map.

A lidar that has come out of adjustment errs alike in all directions. Where most beams end on the map's surfaces, the
median over the beams of what they measured beyond the range on the map is that error: people and furniture that the map
does not have are few, and an error of the robot's pose makes ranges too long on one side and too short on the other.
"""

import numpy as np

from mjnav.estimation.lidar.rays import Rays
from mjnav.geometry.compiled import exact
from mjnav.geometry.distance_field import FieldGrid, lookup

BIN = 0.01  # [m] of the histogram of which the median is taken
REACH = 0.5  # [m] beyond which a difference is no error of the lidar
MIN_BEAMS = 30  # within REACH
MIN_INCIDENCE = 0.5  # cosine; at more slanting incidence a small error of the heading is a large one of the range
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
    """The median of the ranges measured less those on the map [m]; 0 where too few beams meet the map.

    Only of beams within REACH, which do not meet the map at slanting incidence.
    """
    num_bins = int(2.0 * REACH / BIN)
    counts, total = np.zeros(num_bins, np.int64), 0
    for i in range(len(rays.ranges)):
        if rays.min_range <= rays.ranges[i] <= rays.max_range:
            expected, incidence = map_range(rays, i, grid)
            difference = rays.ranges[i] - expected
            if incidence > MIN_INCIDENCE and abs(difference) < REACH:
                counts[min(int((difference + REACH) / BIN), num_bins - 1)] += 1
                total += 1
    if total < MIN_BEAMS:
        return 0.0
    below = 0
    for k in range(num_bins):
        if 2 * (below + counts[k]) >= total:
            return (k + (0.5 * total - below) / counts[k]) * BIN - REACH
        below += counts[k]
    return 0.0
