"""Poses all over the free floor at which a scan fits: for a start anywhere, and for a robot that was carried away.

Poses drawn evenly over the floor are too far apart for a likelihood that is a few centimetres wide: none of them would
fit. So the likelihood is first taken as wide as the poses are apart, and narrowed level by level while the best poses
are drawn again and spread a little less each time (annealed importance sampling: Neal 2001). Poses that fit equally
well in different places stay side by side.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.constant import Constant
from mjnav.estimation.lidar.cloud import TEMPER, tempered
from mjnav.estimation.lidar.contradictions import contradictions, ways_of
from mjnav.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.filters.resampling import systematic
from mjnav.geometry.angles import wrap
from mjnav.geometry.floor import Floor
from mjnav.geometry.free_space import FreeSpace
from mjnav.messages import Array

PER_AREA = 80.0  # [1/m^2] poses drawn first
MOST = 20_000  # poses drawn first, on large floors
KEPT = 1000  # poses of each further level
FOUND = 300  # poses that come out


@dataclass(frozen=True, slots=True)
class Level(Constant):
    """One level of the search."""

    spread: float  # [m] by which the likelihood is widened
    num_beams: int
    shift: float  # [m] std by which poses are spread for the next level
    turn: float  # [rad]
    temper: float = 1.0  # of the likelihood; the last level leaves modes as a scan of the filter does


LEVELS = (
    Level(0.3, 24, 0.15, 0.1),
    Level(0.12, 40, 0.06, 0.04, 0.5),
    Level(0.04, 60, 0.02, 0.012, 0.2),
    Level(0.02, 60, 0.01, 0.006, TEMPER),
)
KEEPS = 0.1  # of a level's poses, as effective sample size, whatever the likelihood says: so that no mode dies at once


@dataclass(frozen=True, slots=True)
class FloorSearch(Constant):
    """The free floor of a map, from which poses are drawn."""

    field: LikelihoodField
    places: Array  # (k, 2) [m] centres of the cells in which the robot may be
    cell: float  # [m]

    @classmethod
    def of(cls, field: LikelihoodField, floor: Floor, radius: float, route: Array) -> "FloorSearch":
        """The part of a floor on which a robot with this radius [m] can come to the points of its `route` (k, 2).

        All of the free floor where the map has no free place at the goal.
        """
        space = FreeSpace.of(floor, route)
        parts = space.parts(radius)
        goal = space.part_of(route[-1:], radius)[0]
        rows, columns = np.nonzero(parts == goal if goal > 0 else space.clearance >= radius)
        places = space.low + space.cell * np.column_stack([columns, rows])
        return cls(field, np.asarray(places, float), space.cell)

    def uniform(self, num: int, rng: np.random.Generator) -> Array:
        """Poses spread evenly over the floor and all headings, (num, 3)."""
        chosen = self.places[rng.integers(len(self.places), size=num)]
        chosen = chosen + self.cell * (rng.random((num, 2)) - 0.5)
        return np.column_stack([chosen, np.pi * (1.0 - 2.0 * rng.random(num))])

    def found(self, points: Array, rng: np.random.Generator) -> Array:
        """Poses at which a scan fits best, (FOUND, 3); `points` as `scan_points` gives them."""
        area = len(self.places) * self.cell**2
        poses = self.uniform(int(min(max(PER_AREA * area, KEPT), MOST)), rng)
        for level in LEVELS:
            fit = self.field.log_ratio(poses, self.field.beams(points, level.num_beams, level.spread))
            if level is LEVELS[-1]:
                fit += contradictions(poses, ways_of(points, self.field, level.num_beams), self.field)[0]
            num = FOUND if level is LEVELS[-1] else KEPT
            poses = poses[systematic(tempered(level.temper * fit, KEEPS), rng.random(), num)]
            poses = poses + rng.standard_normal(poses.shape) * (level.shift, level.shift, level.turn)
            poses[:, 2] = wrap(poses[:, 2])
        return poses
