"""Returns that are of no body: mixed pixels and outliers.

A beam has a width, and where it meets two surfaces its return may come from anywhere between them: a mixed pixel. One
edge mixes no more beams than the width covers. And noise with heavy tails now and then moves a single return far.
"""

import numpy as np

from mjnav.estimation.lidar.clusters import OUTLIER, SIGMAS, step_between
from mjnav.estimation.lidar.explained import meets_map
from mjnav.geometry.compiled import exact

MAX_LONE = 8  # lone returns of bodies in a scan; more come from a lidar that errs, and then pairs count no more either
MIN_EVIDENCE = 50.0  # sum of squares of the excess of two returns or more; of a lone one it is OUTLIER squared


@exact
def bodies_among(rays, excess, beams, starts, grid, covariance):
    """Which runs of returns are of a body that the map does not have, a flag each.

    excess (B,): by how many standard deviations the map fails to explain each beam.
    """
    kept, lone = np.zeros(len(starts) - 1, np.bool_), 0
    for c in range(len(starts) - 1):
        run = beams[starts[c] : starts[c + 1]]
        evidence = 0.0
        for k in range(len(run)):
            evidence += excess[run[k]] ** 2
        least = MIN_EVIDENCE if len(run) > 1 else OUTLIER * OUTLIER
        kept[c] = evidence >= least and not straggler(rays, run, grid, covariance)
        lone += kept[c] and len(run) == 1
    if lone > MAX_LONE:
        for c in range(len(starts) - 1):
            kept[c] = kept[c] and starts[c + 1] - starts[c] > 2
    return kept


@exact
def straggler(rays, beams, grid, covariance):
    """Whether returns no more than one edge may mix are none of a body of their own.

    But mixed pixels, between what is nearer at one side and farther at the other, or beyond a surface of the map that
    the beam passed by less than its width and SIGMAS of the robot's uncertainty; or an outlier of what the beam beside
    met.
    """
    first, last, num = beams[0], beams[-1], len(rays.ranges)
    if len(beams) == 1:
        here, noise = rays.ranges[first], OUTLIER * rays.spread[first]
        if min(abs(rays.ranges[first - 1] - here), abs(rays.ranges[(first + 1) % num] - here)) < noise:
            return True
    mixed = 1 + int(rays.width / rays.step + 0.5)
    if len(beams) > mixed or rays.width == 0.0:
        return False
    least, most = min(rays.ranges[first], rays.ranges[last]), max(rays.ranges[first], rays.ranges[last])
    beside = np.zeros((2, 2), np.bool_)  # at either side: something nearer, farther
    for k in range(1, mixed + 1):
        for side, other in ((0, first - k), (1, last + k)):
            away = rays.ranges[other % num]
            beside[side, 0] |= away < least
            beside[side, 1] |= away > most
    if (beside[0, 0] and beside[1, 1]) or (beside[0, 1] and beside[1, 0]):
        return True
    spread = 0.5 * rays.width + SIGMAS * np.sqrt(covariance[2, 2])
    margin = SIGMAS * np.sqrt(max(covariance[0, 0], covariance[1, 1]))
    end = least - step_between(rays, first, first) - margin - spread * least
    return meets_map(rays, first, grid, end, margin, spread) or meets_map(rays, last, grid, end, margin, spread)
