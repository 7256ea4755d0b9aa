"""Likelihood of a scan at a pose: the likelihood field of Thrun, Burgard & Fox (2005), section 6.4, and two additions.

A return at the range r, seen from a pose, lies at the distance d from the nearest surface of the map. Its density is

    p(r | pose) = z_hit N(d; 0, s^2) + z_short l exp(-l r) / (1 - exp(-l r_max)) + z_rand / r_max

with s^2 = std(r)^2 + resolution^2/12 + MODEL_STD^2. The second term is for what stands before the surfaces: people, and
what the map does not have (ibid., eq. 6.6). It depends on the range alone, as the third one does, so that a return
which no surface explains tells nothing of the pose. Nor does a beam that met nothing: its density is z_max everywhere.

The book takes d for the distance to the nearest occupied point. Here it is the distance to the surface that faces the
lidar: behind a wall of 0.1 m, seen from outside, lies another surface, and a pose 0.1 m off would fit as well.

The first addition estimates from the map an error that all ranges of a scan share. A lidar that has come out of
adjustment errs alike in all directions. Where most beams end on the map's surfaces, the median over the beams of what
they measured beyond the range on the map is that error: people and furniture that the map does not have are few, and an
error of the robot's pose makes ranges too long on one side and too short on the other.

The second addition counts beams that went through a surface of the map: they speak against a pose. The field looks only
at where beams end. A pose in the wrong room may put many ends on surfaces while beams would have to pass through walls,
and a beam that met nothing has no effect on it at all. So where poses from all over the floor are compared, each of the
scan's beams is also followed from the lidar to its end, or to the lidar's range where it met nothing. One that comes
through a surface multiplies the likelihood of the pose by CONTRADICTION, about the share of readings that come about by
chance (the random and maximal readings of Thrun, Burgard & Fox 2005, section 6.3).
"""

from dataclasses import dataclass
from math import log, sqrt
from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, exact, kernel
from mjnav.constant import Constant
from mjnav.geometry.distance_field import DistanceField, FieldGrid, interpolated, lookup
from mjnav.geometry.floor import Floor
from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.scene.sensors import Lidar

# --------------------------------------------------------------------------------- likelihood field


# Weights of the mixture. They sum to 1 with that of beams that met nothing, z_max, which is 0 for those that did.
Z_HIT, Z_SHORT, Z_RANDOM = 0.75, 0.2, 0.05
SHORT_RATE = 0.5  # l [1/m]: every other person or thing that is not on the map stands within 1.4 m
MODEL_STD = 0.01  # [m]: of a surface against the field, and of the robot's motion during the scan
CELL = 0.025  # [m] of the field: beside a table's leg of 3 cm radius it errs by 5 mm
NUM_BEAMS = 60  # of a scan, chosen evenly; more would cost more and say little more, as neighbours see the same
NEGLIGIBLE = 20.0  # of d^2 / (2 s^2): exp(-20) = 2e-9
LOGARITHM_EVERY = 16  # factors; each is at most 1e6, so their product stays finite


class Beams(NamedTuple):
    """The returns of a scan that count."""

    points: Matrix  # (b, 2) [m] in the robot's frame
    directions: Matrix  # (b, 2) unit vectors from the lidar, in the robot's frame
    precision: Vector  # (b,) 1 / s^2 [1/m^2]
    peak: Vector  # (b,) z_hit N(0; 0, s^2) over the density of a return that no surface explains

    @property
    def num(self) -> int:
        """b."""
        return len(self.points)


@dataclass(frozen=True, slots=True)
class LikelihoodField(Constant):
    """The map of a lidar, as its returns see it."""

    field: DistanceField
    thickness: Array  # (rows, columns) [m] at each node of the field: of the body that is nearest to it
    lidar: Lidar
    noise: Distribution  # of the channel lidar.range

    @classmethod
    def of(cls, floor: Floor, lidar: Lidar, noise: Distribution) -> "LikelihoodField":
        """Of a floor that has what stands as high as the lidar."""
        field = DistanceField.of(floor, CELL)
        sizes = 2.0 * np.concatenate([floor.discs[:, 2], floor.boxes[:, 4:].min(axis=1)])
        return cls(field, sizes[floor.nearest(field.nodes)[1]], lidar, noise)

    @property
    def is_empty(self) -> bool:
        """Whether the map has nothing that the lidar could meet."""
        return not self.thickness.size

    def beams(self, points: Array, num: int = NUM_BEAMS, spread: float = 0.0) -> Beams:
        """At most `num` of the returns at `points` (B, 2), in the robot's frame and NaN where there are none.

        Chosen evenly among the returns in the order of the beams. `spread` [m] is added to s: for poses that are no
        nearer to one another than that.
        """
        met = np.flatnonzero(np.isfinite(points[:, 0]))
        if len(met) > num:
            met = met[(np.arange(num) * len(met)) // num]
        ends = points[met]
        ways = ends - self.lidar.mount[:2]
        ranges = np.hypot(ways[:, 0], ways[:, 1])
        precision, peak = self.hits(ranges, spread)
        return Beams(np.ascontiguousarray(ends), ways / np.maximum(ranges, 1e-9)[:, None], precision, peak)

    def hits(self, ranges: Array, spread: float = 0.0) -> tuple[Array, Array]:
        """`precision` and `peak` of `Beams`, for returns at ranges (b,) [m]."""
        variance = self.lidar.std(ranges, self.noise) ** 2
        variance += self.lidar.resolution**2 / 12.0 + MODEL_STD**2 + spread**2
        return 1.0 / variance, Z_HIT / np.sqrt(2.0 * np.pi * variance) / self.unexplained(ranges)

    def unexplained(self, ranges: Array) -> Array:
        """Density [1/m] of returns at `ranges` [m] that no surface explains, of their shape."""
        reach = self.lidar.max_range
        short = SHORT_RATE * np.exp(-SHORT_RATE * ranges) / -np.expm1(-SHORT_RATE * reach)
        return Z_SHORT * short + Z_RANDOM / reach

    def log_ratio(self, poses: Array, beams: Beams) -> Array:
        """Of poses (n, 3), log of p(returns | pose) over their density where no surface explains any of them, (n,)."""
        return _log_ratio(poses, beams, self.field.grid, self.thickness)


@kernel
def _log_ratio(poses: Matrix, beams: Beams, grid: FieldGrid, thickness: Matrix):
    """sum_b log(1 + peak_b exp(-d_b^2 precision_b / 2))."""
    found = np.empty(len(poses))
    num = len(beams.points)
    last_row, last_column = float(thickness.shape[0] - 1), float(thickness.shape[1] - 1)
    inverse = 1.0 / grid.cell
    for i in range(len(poses)):
        c, s = np.cos(poses[i, 2]), np.sin(poses[i, 2])
        left, low = (poses[i, 0] - grid.x) * inverse, (poses[i, 1] - grid.y) * inverse
        cosine, sine = c * inverse, s * inverse
        total, product = 0.0, 1.0
        for b in range(num):
            u = left + cosine * beams.points[b, 0] - sine * beams.points[b, 1]
            v = low + sine * beams.points[b, 0] + cosine * beams.points[b, 1]
            if 0.0 <= u <= last_column and 0.0 <= v <= last_row:  # beyond, all surfaces are far
                distance, away_x, away_y = interpolated(grid.clearance, u, v)
                ux = c * beams.directions[b, 0] - s * beams.directions[b, 1]
                uy = s * beams.directions[b, 0] + c * beams.directions[b, 1]
                if away_x * ux + away_y * uy > 0.0:  # the surface looks away from the lidar: the one before it counts
                    distance += thickness[int(v + 0.5), int(u + 0.5)]
                exponent = 0.5 * distance * distance * beams.precision[b]
                if exponent < NEGLIGIBLE:
                    product *= 1.0 + beams.peak[b] * np.exp(-exponent)
            if b % LOGARITHM_EVERY == LOGARITHM_EVERY - 1:
                total += np.log(product)
                product = 1.0
        found[i] = total + np.log(product)
    return found


# ---------------------------------------------------------------------- error that all ranges share


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
def map_ranges(origins: Matrix, directions: Matrix, max_range: float, grid: FieldGrid):
    """The ranges (B,) [m] at which beams meet the map, inf for none; and the cosines of their incidence there, (B,)."""
    ranges, incidences = np.full(len(origins), np.inf), np.zeros(len(origins))
    for i in range(len(origins)):
        ux, uy = directions[i, 0], directions[i, 1]
        along = 0.0
        for _ in range(MAX_STEPS):
            clearance, nx, ny = lookup(grid, origins[i, 0] + along * ux, origins[i, 1] + along * uy)
            along += clearance
            if clearance < CLOSE:
                ranges[i], incidences[i] = along, abs(nx * ux + ny * uy)
                break
            if along > max_range:
                break
    return ranges, incidences


def shared_error(origins: Array, directions: Array, ranges: Array, lidar: Lidar, grid: FieldGrid) -> float:
    """The median of the ranges measured less those on the map [m]; 0 where too few beams meet the map, or differ.

    Only of beams within REACH, which do not meet the map at slanting incidence. origins and directions: (B, 2), ranges
    (B,).
    """
    with np.errstate(invalid="ignore"):
        met = (lidar.min_range <= ranges) & (ranges <= lidar.max_range)
    ranges = ranges[met]
    expected, incidence = map_ranges(origins[met], directions[met], lidar.max_range, grid)
    difference, facing = ranges - expected, incidence > MIN_INCIDENCE
    near = difference[facing & (np.abs(difference) < REACH)]
    if len(near) < MIN_BEAMS:
        return 0.0
    num_bins = int(2.0 * REACH / BIN)
    counts = np.bincount(np.minimum(((near + REACH) / BIN).astype(int), num_bins - 1), minlength=num_bins)
    middle = int(np.searchsorted(2 * np.cumsum(counts), len(near)))
    alike = counts[max(middle - ALIKE, 0) : middle + ALIKE + 1].sum()
    returns = np.count_nonzero(facing | (expected == np.inf))
    return (middle + 0.5) * BIN - REACH if alike >= ALIKE_SHARE * returns else 0.0


def put_right(points: Array, lidar: Lidar, pose: Array, covariance: Array, grid: FieldGrid) -> Array:
    """A scan's points (B, 2) in the frame of the robot at `pose` (3,), with `covariance` (3, 3), without that error."""
    away = points - lidar.mount[:2]
    ranges = np.hypot(away[:, 0], away[:, 1])
    directions = away / np.maximum(ranges, CLOSE)[:, None]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    to_world = np.array([[c, s], [-s, c]])
    origins = np.tile(lidar.mount[:2] @ to_world + pose[:2], (len(points), 1))
    error = shared_error(origins, directions @ to_world, ranges, lidar, grid)
    error = beyond_doubt(error, covariance)
    return points - error * directions if error else points


def beyond_doubt(error: float, covariance: Array) -> float:
    """The error [m], or 0 where the robot's uncertainty (3, 3) may explain it."""
    doubt = LEAST + SIGMAS * sqrt(max(covariance[0, 0], covariance[1, 1]))
    return error if abs(error) > doubt else 0.0


# --------------------------------------------------------------------------- beams through surfaces


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
