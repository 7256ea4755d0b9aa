"""Where on the whole map a scan fits best: a coarse search, of which the best poses are matched.

Poses on a regular grid are scored by the mean of w = (m / (m + c^2))^2 over some of the scan's points, c being the
map's clearance there. Each of the best is matched (`scan_matching`), and surfaces that a beam would have to cross count
against it: fit = explained share - share of beams that cross a surface of the map.
"""

import numpy as np

from mjnav.constant import Constant
from mjnav.estimation.lidar.scan_matching import MatchSettings, ScanMatch, match_scan
from mjnav.geometry.compiled import kernel
from mjnav.geometry.distance_field import DistanceField, FieldGrid, lookup
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array

STEP = 0.3  # [m] between positions; more on maps of more than MAX_POSITIONS
MAX_POSITIONS = 3000
NUM_HEADINGS = 32
NUM_POINTS = 45  # of the scan that score a pose
NUM_MATCHED = 20  # poses
WIDTH = 0.15  # [m] root of m: about the coarseness of the poses
ROOM = 0.2  # [m] that the robot takes up, at least
INSIDE = 0.03  # [m] below a surface at which a beam has crossed it
NOWHERE = 10.0  # [m] std of a position on a map that has nothing
CROSSING = np.linspace(0.1, 0.9, 9)  # of the way along a beam


class PoseSearch(Constant):
    """The places of a map where the robot may be."""

    def __init__(self, field: DistanceField, settings: MatchSettings | None = None):
        self._field, self._settings = field, settings or MatchSettings()
        self._positions = _free_positions(field)
        self._headings = 2.0 * np.pi * np.arange(NUM_HEADINGS) / NUM_HEADINGS - np.pi

    def best(self, points: Array, range_std: Array) -> ScanMatch | None:
        """The best match of points (n, 2) as `match_scan` takes them; None without points and on an empty map.

        `explained` of the match is its fit, which may be negative.
        """
        there = np.flatnonzero(np.isfinite(points).all(axis=1))
        if not (len(there) and len(self._positions)):
            return None
        some = points[there[np.linspace(0, len(there) - 1, min(NUM_POINTS, len(there))).astype(int)]]
        scores = _scores(np.ascontiguousarray(some), self._positions, self._headings, self._field.grid, WIDTH**2)
        places, headings = np.unravel_index(np.argsort(scores, axis=None)[: -NUM_MATCHED - 1 : -1], scores.shape)
        found = [
            self._fitted(points, match_scan(self._field, points, range_std, guess, self._settings))
            for guess in np.column_stack([self._positions[places], self._headings[headings]])
        ]
        return max(found, key=lambda match: match.explained)

    @property
    def anywhere(self) -> tuple[Array, Array]:
        """Mean (3,) and covariance (3, 3) of a pose of which only the map is known, if it has anything."""
        if not len(self._positions):
            return np.zeros(3), np.diag(np.square([NOWHERE, NOWHERE, np.pi]))
        spread = np.append(self._positions.std(axis=0) + STEP, np.pi)
        return np.append(self._positions.mean(axis=0), 0.0), np.diag(spread**2)

    def fit(self, points: Array, match: ScanMatch) -> float:
        """How well a match fits: the share of points on surfaces less the share of beams that cross one."""
        seen = points[np.isfinite(points).all(axis=1)]
        c, s = np.cos(match.pose[2]), np.sin(match.pose[2])
        along = (CROSSING[:, None, None] * (seen @ np.array([[c, s], [-s, c]]))).reshape(-1, 2)
        clearance = self._field.clearance(match.pose[:2] + along).reshape(len(CROSSING), -1)
        return match.explained - float((clearance < -INSIDE).any(axis=0).mean())

    def _fitted(self, points: Array, match: ScanMatch) -> ScanMatch:
        return ScanMatch(match.pose, match.covariance, match.num_points, self.fit(points, match))


def _free_positions(field: DistanceField) -> Array:
    """Positions of a regular grid where the robot has room, (n, 2) [m]."""
    grid = field.grid
    if not grid.clearance.size:
        return np.zeros((0, 2))
    step = STEP
    while True:
        stride = max(round(step / grid.cell), 1)
        j, i = np.nonzero(grid.clearance[::stride, ::stride] > ROOM)
        if len(i) <= MAX_POSITIONS:
            step = stride * grid.cell
            return np.asarray(np.column_stack([grid.x + step * i, grid.y + step * j]), float)
        step *= 1.25


@kernel
def _scores(points: Matrix, positions: Matrix, headings: Vector, grid: FieldGrid, m: float):
    """Mean weight of points (n, 2) at each of the positions (p, 2) with each of the headings (h,): (p, h)."""
    scores = np.zeros((len(positions), len(headings)))
    for h in range(len(headings)):
        cos, sin = np.cos(headings[h]), np.sin(headings[h])
        for p in range(len(positions)):
            total = 0.0
            for i in range(len(points)):
                x = positions[p, 0] + cos * points[i, 0] - sin * points[i, 1]
                y = positions[p, 1] + sin * points[i, 0] + cos * points[i, 1]
                c = lookup(grid, x, y)[0]
                weight = m / (m + c * c)
                total += weight * weight
            scores[p, h] = total / len(points)
    return scores
