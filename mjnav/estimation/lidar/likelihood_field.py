"""How likely a scan is at a pose: the likelihood field of Thrun, Burgard & Fox (2005), section 6.4.

A return at the range r, seen from a pose, lies at the distance d from the nearest surface of the map. Its density is

    p(r | pose) = z_hit N(d; 0, s^2) + z_short l exp(-l r) / (1 - exp(-l r_max)) + z_rand / r_max

with s^2 = std(r)^2 + resolution^2/12 + MODEL_STD^2. The second term is for what stands before the surfaces: people, and
what the map does not have (ibid., eq. 6.6). It depends on the range alone, as the third one does, so that a return
which no surface explains tells nothing of the pose. Nor does a beam that met nothing: its density is z_max everywhere.

The book takes d for the distance to the nearest occupied point. Here it is the distance to the surface that faces the
lidar: behind a wall of 0.1 m, seen from outside, lies another surface, and a pose 0.1 m off would fit as well.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mjnav.constant import Constant
from mjnav.geometry.compiled import exact, kernel
from mjnav.geometry.distance_field import DistanceField, FieldGrid, interpolated
from mjnav.geometry.floor import Floor, box_surface, disc_surface
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array
from mjnav.noise import Distribution
from mjnav.scenarios.lidar import Lidar

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
        grid = field.grid
        thickness = _thickness(grid.clearance.shape, grid.x, grid.y, grid.cell, floor.discs, floor.boxes)
        return cls(field, thickness, lidar, noise)

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


@exact
def _thickness(shape: tuple[int, int], x: float, y: float, cell: float, discs: Matrix, boxes: Matrix):
    """Of the body nearest to each node of a grid: a disc's diameter, a box's lesser side."""
    found = np.zeros(shape)
    for row in range(shape[0]):
        for column in range(shape[1]):
            at_x, at_y, nearest = x + column * cell, y + row * cell, np.inf
            for j in range(len(discs)):
                distance = disc_surface(at_x, at_y, discs[j])[0]
                if distance < nearest:
                    nearest, found[row, column] = distance, 2.0 * discs[j, 2]
            for j in range(len(boxes)):
                distance = box_surface(at_x, at_y, boxes[j])[0]
                if distance < nearest:
                    nearest, found[row, column] = distance, 2.0 * min(boxes[j, 4], boxes[j, 5])
    return found
