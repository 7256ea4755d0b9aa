"""Beams that went through what the map has: they speak against a pose, which the likelihood field does not hear.

The field looks at where beams end. A pose in the wrong room may put many ends on surfaces while beams would have to
pass through walls, and a beam that met nothing says nothing to it at all. So where poses from all over the floor are
compared, each of the scan's beams is also followed from the lidar to its end, or to the lidar's range where it met
nothing. One that comes through a surface multiplies the likelihood of the pose by CONTRADICTION, about the share of
readings that come about by chance (the random and maximal readings of Thrun, Burgard & Fox 2005, section 6.3).
"""

from math import log
from typing import NamedTuple

import numpy as np

from mjnav.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.geometry.compiled import kernel
from mjnav.geometry.distance_field import FieldGrid, lookup
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array

CONTRADICTION = 0.02
LOG_CONTRADICTION = log(CONTRADICTION)
SLACK = 0.25  # [m] before a beam's end that is not looked at: its error, and surfaces that it grazes
TOUCHED = 0.02  # [m] from a surface, where the beam is taken to have met it
MIN_STEP = 0.02  # [m]


class Ways(NamedTuple):
    """Beams of a scan with their ends, met or not."""

    angles: Vector  # (b,) [rad] in the robot's frame
    reaches: Vector  # (b,) [m] for which they are known to be free
    place: Vector  # (2,) [m] of the lidar in the robot's frame
    points: Matrix  # (b, 2) [m] ends in the robot's frame, NaN where they met nothing
    precision: Vector  # (b,) as in `Beams`
    peak: Vector  # (b,)


def ways_of(points: Array, field: LikelihoodField, num: int) -> Ways:
    """At most `num` beams, chosen evenly in angle; `points` (B, 2) as `scan_points` gives them.

    A beam without a point met nothing within the lidar's range. Motion during the scan is undone for the others alone.
    """
    lidar = field.lidar
    chosen = (np.arange(min(num, len(points))) * len(points)) // min(num, len(points))
    ends = points[chosen]
    ways = ends - lidar.mount[:2]
    met = np.isfinite(ways[:, 0])
    angles = np.where(met, np.arctan2(ways[:, 1], ways[:, 0]), lidar.angles[chosen] + lidar.mount[2])
    lengths = np.where(met, np.hypot(ways[:, 0], ways[:, 1]), lidar.max_range)
    precision, peak = field.hits(lengths)
    reaches = np.maximum(lengths - SLACK, 0.0)
    return Ways(angles, reaches, lidar.mount[:2].copy(), np.ascontiguousarray(ends), precision, peak)


def contradictions(poses: Array, ways: Ways, field: LikelihoodField) -> tuple[Array, Array]:
    """What beams that would have gone through a surface take from `log_ratio` of poses (n, 3): (n,), at most 0.

    The logarithm of CONTRADICTION for each, and what its end had gained. Also which share of the beams they are, (n,).
    """
    found = _contradictions(np.ascontiguousarray(poses), ways, field.field.grid, max(field.lidar.min_range, SLACK))
    return found[:, 0], found[:, 1] / len(ways.angles)


@kernel
def _contradictions(poses: Matrix, ways: Ways, grid: FieldGrid, start: float):
    found = np.zeros((len(poses), 2))
    for i in range(len(poses)):
        c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        at_x = poses[i, 0] + c * ways.place[0] - s * ways.place[1]
        at_y = poses[i, 1] + s * ways.place[0] + c * ways.place[1]
        for b in range(len(ways.angles)):
            ux, uy = np.cos(poses[i, 2] + ways.angles[b]), np.sin(poses[i, 2] + ways.angles[b])
            along = start
            while along < ways.reaches[b]:  # sphere tracing (Hart 1996)
                clearance = lookup(grid, at_x + along * ux, at_y + along * uy)[0]
                if clearance < TOUCHED:
                    found[i, 0] += LOG_CONTRADICTION
                    found[i, 1] += 1.0
                    x, y = ways.points[b, 0], ways.points[b, 1]
                    if x == x:
                        end = lookup(grid, poses[i, 0] + c * x - s * y, poses[i, 1] + s * x + c * y)[0]
                        found[i, 0] -= np.log(1.0 + ways.peak[b] * np.exp(-0.5 * end * end * ways.precision[b]))
                    break
                along += max(clearance - TOUCHED, MIN_STEP)
    return found
