"""Driving without a map: what the robot has seen so far around it, and where it is in that.

    predict   the pose, by wheels and gyro
    match     the scan with the surfaces of all scans before                   (`geometry.surfels`, `scan_matching`)
    correct   the pose by the match
    add       the scan to the map at that pose                                  (`geometry.evidence_grid`)

So errors of the pose go into the map, and both drift slowly from the floor. What is near is right, as both drift alike;
the goal drifts away. How far the frame of scan k may be off, C_k (3, 3), is known from what the scan was matched with:

    C_k = mean over its returns of the C of the surfels that they lie on + A P_k A^T,   C = 0 at the start,

P_k the covariance of the match and A(x, y) what takes an error of a pose at (x, y) to that of its frame at the origin,

    A = ((1, 0, y), (0, 1, -x), (0, 0, 1)).

A surfel has the mean C of the scans that made it. So what was seen from the start stays as sure as it was then, while
the robot drives past it and when it comes back to it. The stated covariance is of the pose on the floor, with this
part. Particles are drawn without it: they are where the robot is among what it has seen, which is what it may touch.

A return where nothing was seen before is taken for what stands there. People are found by returns from where it was
seen free: they have come there, and count once they have gone a way (`tracker`). Returns on somebody who walks are
neither added nor do they say where the robot is. Whoever stands for long is a part of the map until they go, and beams
pass where they stood. Where nothing lasts, wheels and gyro lead.

A robot that has a map knows its pose on that map, and draws what the map lacks: furniture that was moved.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry import evidence_grid
from mjnav.geometry.distance_field import DistanceField, FieldGrid
from mjnav.geometry.distances import placed
from mjnav.geometry.evidence_grid import CELL, UPPER
from mjnav.geometry.floor import Floor
from mjnav.geometry.surfels import Surfels, frame_error, normal_equations, surfels_of
from mjnav.messages import Array, Reading, RobotBelief, Track
from mjnav.robot.estimation.base import HEADING, assumed_noise, error_at
from mjnav.robot.estimation.kalman import Gaussian, symmetrised
from mjnav.robot.estimation.lidar import scan_matching
from mjnav.robot.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar

HALF = 10.0  # [m] that the map reaches from the robot; less for a lidar of less range
SLACK = 2.0  # [m] that the robot may be away from the middle
FIELD_CELL, FIELD_REACH = 0.5 * CELL, 0.5  # [m] of the distance field, and the most that it tells
SURFACE = 0.01  # [m] radius of the discs that stand for an occupied cell
WALKS = 0.25  # [m/s] from which on somebody walks
ON_MAP = 0.15  # [m] from a surface of the known map, beyond which another one is seen
WITHIN = 0.8  # of the robot's radius, within which what it drives over was seen: between pillars its sides may touch
NEAR = 0.2  # [m] from a surfel, within which a return may be one on it
ON_TRACK = 0.3  # [m] from somebody's surface: their returns


class LocalMap:
    """The map of one run."""

    def __init__(self, scenario: Scenario):
        noise, robot = assumed_noise(scenario), scenario.robot
        self._lidar, self._noise = scenario.sensors.scanner, noise["lidar.range"]
        self._history = MotionHistory(TwistSensors.of(noise, robot.limits))
        self._radius = robot.limits.half_width
        self._mode = scan_matching.weighted_law(self._noise)[0]
        x, y, _ = robot.start
        self._grid = evidence_grid.EvidenceGrid.around(x, y, min(HALF, self._lidar.max_range + SLACK))
        self._known = floor_of_lidar(scenario)  # of the map that the robot has from the start
        self._known_field, self._base = DistanceField.of(self._known), np.zeros((0, 0))
        self._at = (np.nan, np.nan)  # [m] of the corner of `_base`
        self.seen = np.zeros((0, 3))  # x, y, radius [m] of discs for what the known map does not have
        self.floor = self._known  # both
        self.field = DistanceField(FieldGrid(np.zeros((0, 0)), 0.0, 0.0, FIELD_CELL))
        self.surfels: Surfels | None = None  # of what lasts, where no map is known
        self.walkers = np.zeros((0, 3))  # x, y, reach [m]: where returns may be somebody's who walks

    def follow(self, reading: Reading, robot: RobotBelief, people: Sequence[Track], frame: Array) -> bool:
        """One more reading, and what is believed after it; whether the map has changed.

        `frame` (6,) is the covariance of the scan's frame.
        """
        self._history.follow(reading)
        points = scan_points(reading, self._history, self._lidar, self._noise)
        if len(points) != len(self._lidar.angles) or not np.isfinite(robot.mean).all():
            return False
        points, _ = scan_matching.centred(points, reading.scan, self._lidar, self._noise, self._mode)
        self._centre(robot.mean)
        c, s = np.cos(robot.mean[HEADING]), np.sin(robot.mean[HEADING])
        met = np.isfinite(points[:, 0])
        x, y, heading = placed(robot.mean, self._lidar.mount)
        beyond = heading + self._lidar.angles
        free = np.array([x, y]) + self._lidar.max_range * np.column_stack([np.cos(beyond), np.sin(beyond)])
        ends = np.where(met[:, None], robot.mean[:2] + points @ np.array([[c, s], [-s, c]]), free)
        silent = ~met & np.isfinite(reading.scan)  # no range at all, or one of the robot's own body
        rows = [(*p.mean[:2], p.radius + ON_TRACK) for p in people if np.hypot(*p.mean[2:]) > WALKS]
        self.walkers = np.array(rows, float).reshape(-1, 3)
        met &= ~within(ends, self.walkers)
        silent |= np.isnan(reading.scan)
        origins = np.tile([x, y], (len(ends), 1))
        evidence_grid.add_scan(self._grid, origins[~silent], ends[~silent], met[~silent], frame)
        evidence_grid.stand(self._grid, float(robot.mean[0]), float(robot.mean[1]), self._radius)
        surfaces = self._grid.surfaces()
        low, size = np.array([self._grid.x, self._grid.y]), CELL * len(self._grid.odds)
        grid = evidence_grid.field_of(surfaces, low, size, FIELD_CELL, FIELD_REACH)
        if self._known.bounds is None:
            not_free = np.repeat(np.repeat(self._grid.odds > evidence_grid.FREE, 2, 0), 2, 1)
            not_free = np.pad(not_free, (0, 1), mode="edge")
            grid = grid._replace(clearance=np.where(not_free, 0.0, grid.clearance))
            self.surfels = surfels_of(self._grid, NEAR)
        else:
            surfaces = surfaces[self._known.clearance(surfaces) > ON_MAP]
            grid = grid._replace(clearance=np.minimum(grid.clearance, self._on_known(grid)))
        self.field = DistanceField(grid)
        self.seen = np.column_stack([surfaces, np.full(len(surfaces), SURFACE)])
        self.floor = Floor(np.concatenate([self._known.discs, self.seen]), self._known.boxes)
        return True

    @property
    def unseen(self) -> FieldGrid:
        """1 at the middles of cells of which no scan says anything yet, 0 elsewhere."""
        grid = self._grid
        nothing = (grid.odds > evidence_grid.FREE) & (grid.odds <= evidence_grid.OCCUPIED)
        return FieldGrid(nothing.astype(float), grid.x + 0.5 * CELL, grid.y + 0.5 * CELL, CELL)

    def is_free(self, pose: Array, v: float, omega: float, way: float) -> bool:
        """Whether `way` [m], and a cell more, were seen free from `pose` (3,) along the arc of (v, omega).

        With a map from the start that is no question: what was not seen is as on the map.
        """
        if self._known.bounds is not None:
            return True
        most, radius = way + CELL, WITHIN * self._radius
        return bool(evidence_grid.seen_free(self._grid, np.array(pose, float), v, omega, radius, most) >= most)

    def _on_known(self, grid: FieldGrid) -> Array:
        """The clearance of the known map at the nodes of a grid; looked up where the window has moved."""
        if self._at != (grid.x, grid.y):
            self._base = self._known_field.clearance(DistanceField(grid).nodes).reshape(grid.clearance.shape)
            self._at = grid.x, grid.y
        return self._base

    def _centre(self, pose: Array) -> None:
        """Takes the window along."""
        away = pose[:2] - self._grid.middle
        if np.abs(away).max() > SLACK:
            columns, rows = np.round(away / CELL).astype(int).tolist()
            self._grid = self._grid.moved(columns, rows)


def within(points: Array, discs: Array) -> NDArray[np.bool_]:
    """Which of `points` (n, 2) lie in one of `discs` (k, 3); NaN does not."""
    x, y = points[:, :1] - discs[:, 0], points[:, 1:] - discs[:, 1]
    return np.any(x * x + y * y < discs[:, 2] ** 2, axis=1)


class MappingLocalizer(scan_matching.MatchingLocalizer):
    """The robot's pose on its own map."""

    def __init__(self, scenario: Scenario, seed: int):
        """At the scenario's start, which is where the map's frame lies."""
        noise = assumed_noise(scenario)
        twists = TwistSensors.of(noise, scenario.robot.limits)
        start = Gaussian(np.array(scenario.robot.start, float), 1e-8 * np.eye(3))
        num = scenario.estimation.robot.particles
        super().__init__(scenario.sensors.scanner, noise["lidar.range"], twists, start, num, seed)
        self._surfels: Surfels | None = None
        self._walkers = np.zeros((0, 3))
        self._matched = np.zeros((3, 3))  # mean covariance of the frames of what the latest scan was matched with

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> Self:
        """As the other localizers by lidar are made."""
        return cls(scenario, seed)

    def learn(self, local: LocalMap) -> None:
        """The map as it is now."""
        self._surfels, self._walkers = local.surfels, local.walkers

    @property
    def frame(self) -> Array:
        """The covariance (6,) of the frame of the latest scan, at the origin."""
        past = self._pose.past
        to_origin = error_at(-past.mean[:2])
        return (self._matched + to_origin @ past.covariance @ to_origin.T)[UPPER]

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading; the covariance has the frame's."""
        belief = super().update(reading)
        from_origin = error_at(belief.mean[:2])
        covariance = symmetrised(belief.covariance + from_origin @ self._matched @ from_origin.T)
        self._belief = replace(belief, covariance=covariance)
        return self._belief

    def _points(self, reading: Reading) -> Array:
        points, (x, y, heading) = super()._points(reading), self._pose.now.mean
        c, s = np.cos(heading), np.sin(heading)
        points[within([x, y] + points @ np.array([[c, s], [-s, c]]), self._walkers)] = np.nan
        return points

    def _match(self, points: Array, std: Array, guess: Array) -> scan_matching.ScanMatch:
        surfels, met = self._surfels, np.isfinite(points[:, 0])
        points, variance = np.ascontiguousarray(points[met]), std[met] ** 2

        def equations(pose: Array, m: float) -> tuple[Array, Array, float]:
            return normal_equations(surfels, points, variance, pose, scan_matching.MAP_STD**2, m)

        match = scan_matching.best_match(equations, len(points) if surfels else 0, guess, self._inflation)
        if surfels and match.explained > 0.0:
            self._matched[UPPER] = self._matched.T[UPPER] = frame_error(surfels, points, match.pose)
        return match
