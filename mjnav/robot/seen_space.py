"""Obstacles around the robot: the known map as controllers use it, and what the latest scan saw besides.

The map has legs and pillars as discs at rest, and walls as the faces towards the robot; of many the nearest.

The scan's part is what a method is not told of, and how far the robot may go before it. Returns from a surface of the
map and from somebody who is tracked are the method's own affair. All others may be anything: somebody who is not
tracked yet, a thing that the map misses, a wall where the robot is not where it believes.

A beam that returned saw the space up to its point. A beam that met nothing saw all of its range, unless the map has a
surface there: then it saw nothing at all, and neither did a beam that is covered, that is no number, or that is beyond
the lidar's field of view. Next to one another such beams leave a gap of angle g, in which a body of radius HIDDEN goes
unseen from the distance HIDDEN / sin(g / 2) on. There the gap counts as an obstacle.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat

import numpy as np
from numpy.typing import NDArray

from mjnav.constant import Constant
from mjnav.geometry.distances import WHOLE_TURN, placed, segment_distance
from mjnav.messages import MOST_STANDING, Array, KnownMap, ObstacleSamples, Reading, Track
from mjnav.noise import Distribution
from mjnav.robot.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar
from mjnav.sealed import sealed

# --------------------------------------------------------------------------------------- static map


AT_REST = sealed(np.zeros((1, 2)))


class FloorMap(Constant):
    """Static obstacles of the map that the robot has, with their names for the log."""

    def __init__(self, scenario: Scenario, seen: Array | None = None):
        """Of the scenario's map; where `seen` (k, 3) is given, of these discs besides."""
        known = scenario.known_bodies
        legs = [(leg, table.leg_radius, name) for table, name in zip(known.tables, known.table_names, strict=True)
                for leg in table.legs]  # fmt: skip
        pillars = [(p.position, p.radius, name) for p, name in zip(known.pillars, known.pillar_names, strict=True)]
        named = np.array([(*at, radius) for at, radius, _ in (*legs, *pillars)], float).reshape(-1, 3)
        self._disc_names = tuple(name for *_, name in (*legs, *pillars))
        discs = named if seen is None else np.concatenate([named, seen])
        self._positions = sealed(discs[:, None, :2])
        self._wall_names = known.wall_names

        start = np.array([wall.start for wall in known.walls], float).reshape(-1, 2)
        end = np.array([wall.end for wall in known.walls], float).reshape(-1, 2)
        half = 0.5 * np.array([[wall.thickness] for wall in known.walls]).reshape(-1, 1)
        along = end - start
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        self._across = half * np.stack([-along[:, 1], along[:, 0]], axis=1)
        self._middle = (start * self._across).sum(axis=1)
        # A face is as long as the wall with its two ends. The second is the one to the left of start-end.
        ends = np.stack([start - half * along, end + half * along], axis=1)
        self._faces = np.stack([ends - self._across[:, None], ends + self._across[:, None]], axis=1)  # (W, 2, 2, 2)
        self._index = np.arange(len(ends))
        left, right = (None, None) if scenario.lanes is None else (scenario.lanes.left, scenario.lanes.right)
        lines = sealed(np.stack([start, end], axis=1))
        self.known = KnownMap(lines, sealed(2.0 * half[:, 0]), sealed(discs), left, right)

    def discs(self, position: Array) -> tuple[ObstacleSamples, ...]:
        """The legs and pillars that controllers see from `position` (2,)."""
        near = self._near_discs(position)
        positions = sealed(self._positions[near])  # all at once: one by one it takes 2 us a disc
        return tuple(map(ObstacleSamples, positions, repeat(AT_REST), self.known.discs[near, 2].tolist()))

    def walls(self, position: Array) -> Array:
        """The faces towards `position` (2,) of the walls that controllers see from there: start and end, (W, 2, 2)."""
        return self._near_walls(position)[1]

    def disc_names(self, position: Array) -> tuple[str, ...]:
        """Of the legs and pillars that controllers see from `position` (2,)."""
        named = len(self._disc_names)
        return tuple(
            self._disc_names[i] if i < named else f"seen{i - named}" for i in self._near_discs(position).tolist()
        )

    def wall_names(self, position: Array) -> tuple[str, ...]:
        """Of the walls that controllers see from `position` (2,)."""
        return tuple(self._wall_names[i] for i in self._near_walls(position)[0])

    def _near_discs(self, position: Array) -> NDArray[np.int_]:
        discs = self.known.discs
        return nearest(len(discs), lambda: np.hypot(*(discs[:, :2] - position).T) - discs[:, 2])

    def _near_walls(self, position: Array) -> tuple[NDArray[np.int_], Array]:
        """The places of the walls and their faces towards `position` (2,)."""
        if not self._index.size:
            return self._index, self._faces[:, 0]
        left = self._across @ position >= self._middle
        faces = self._faces[self._index, left.astype(int)]
        near = nearest(len(faces), lambda: segment_distance(position, faces[:, 0], faces[:, 1]))
        return near, faces[near]


def nearest(num: int, distance: Callable[[], Array]) -> NDArray[np.int_]:
    """The places of the MOST_STANDING nearest of `num` bodies, ascending; few bodies are not asked their distance."""
    if num <= MOST_STANDING:
        return np.arange(num)
    return np.sort(np.argsort(distance(), kind="stable")[:MOST_STANDING])


# --------------------------------------------------------------------------- space seen by the scan


ON_MAP = 0.15  # [m] and 3 std of the range from a surface of the map, beyond which a return is not its own
SURE = 0.9  # share of the lidar's range within which a surface would surely have returned a beam
ON_TRACK = 0.3  # [m] from somebody's surface: as far as they walk between two scans at 10 Hz, and a track's own error
MANY = 10  # returns that are enough to say what share of them the map explains
HIDDEN = 0.05  # [m] radius of the thinnest thing that must not go unseen: a table's leg, an ankle
STRAIGHT = 1e-6  # [1/m] of curvature, below which an arc is a line
SUPPORT = 2  # returns within reach of the arc that make an obstacle: a single one may be an outlier


@dataclass(frozen=True, slots=True)
class Seen:
    """One scan."""

    time: float  # [s] of the reading that brought it
    newest: float  # [s] of its last beam
    points: Array  # (n, 2) [m] in the robot's frame at `time`: of unexplained returns, and where gaps begin
    off_map: float  # share that the map does not explain of the returns where it has a surface; 0 of too few to tell


class SeenSpace:
    """The scans of one run, and how the robot moved since the latest."""

    def __init__(self, scenario: Scenario, noise: Mapping[str, Distribution]):
        """`noise` is the law that the robot assumes of each channel."""
        from mjnav.geometry.beams import cast  # runs without scans do without its kernels

        self._cast = cast
        self._lidar, self._noise = scenario.sensors.scanner, noise["lidar.range"]
        self.floor = floor_of_lidar(scenario)  # of the map, at the lidar's height
        self._history = MotionHistory(TwistSensors.of(noise, scenario.robot.limits))
        self._seen: Seen | None = None
        angles, step = self._lidar.angles, self._lidar.step
        beyond = max(round(WHOLE_TURN / step) - len(angles), 0)  # beams that a whole turn would have besides
        self._beyond = angles[-1] + step * np.arange(1, beyond + 1)

    def follow(self, reading: Reading, pose: Array, people: Sequence[Track]) -> None:
        """One more reading, where the robot believes to be after it, (3,), and whom it tracks."""
        self._history.follow(reading)
        if reading.scan.size == len(self._lidar.angles):
            self._seen = self._look(reading, pose, people)

    def _look(self, reading: Reading, pose: Array, people: Sequence[Track]) -> Seen:
        lidar = self._lidar
        x, y, heading = placed(pose, lidar.mount)
        bodies = self.floor.discs, self.floor.boxes
        expected = np.isfinite(self._cast(np.array([x, y]), heading + lidar.angles, *bodies, SURE * lidar.max_range))
        points = scan_points(reading, self._history, lidar, self._noise)
        returned = np.isfinite(points[:, 0])
        points, expected_too = points[returned], expected[returned]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        places = pose[:2] + points @ np.array([[c, s], [-s, c]])
        spread = lidar.std(reading.scan[returned], self._noise)
        strange = self.floor.clearance(places) > ON_MAP + 3.0 * spread
        off_map = float(strange[expected_too].mean()) if expected_too.sum() >= MANY else 0.0
        for person in people:
            reach = person.radius + ON_TRACK
            strange &= ((places - person.mean[:2]) ** 2).sum(axis=1) > reach * reach
        blind = ~(reading.scan > 0.0) | (np.isposinf(reading.scan) & expected)
        newest = float(reading.scan_times.max()) if reading.scan_times.size else reading.time
        return Seen(reading.time, newest, np.concatenate([points[strange], self._gaps(blind)]), off_map)

    @property
    def contradicts(self) -> bool:
        """Whether wheels and gyro contradict each other in the latest reading."""
        return self._history.latest is not None and self._history.latest.rivals is not None

    @property
    def off_map(self) -> float:
        """Of the latest scan's returns where the map has a surface, the share that it does not explain."""
        return 0.0 if self._seen is None else self._seen.off_map

    def age(self, now: float) -> float:
        """Of the last beam of the latest scan [s]; infinite before the first."""
        return np.inf if self._seen is None else now - self._seen.newest

    def free_way(self, now: float, v: float, omega: float, discs: Iterable[tuple[float, float]]) -> float:
        """How far the robot gets along the arc of (v, omega) until a disc of its meets what was seen, or a gap [m].

        From where it is now; infinite where nothing is on its way, 0 before the first scan.
        """
        if self._seen is None:
            return 0.0
        points = self._seen.points
        if now > self._seen.time + 1e-9:
            x, y, heading = self._history.poses(np.array([self._seen.time]), now)[0]
            c, s = np.cos(heading), np.sin(heading)
            points = np.array([x, y]) + points @ np.array([[c, s], [-s, c]])
        return free_arc(points, v, omega, discs)

    def _gaps(self, blind: NDArray[np.bool_]) -> Array:
        """Points (k, 2) in the robot's frame at which bodies may stand unseen, one for each beam that saw nothing."""
        lidar = self._lidar
        blind = np.append(blind, np.ones(len(self._beyond), bool))
        if not blind.any():
            return np.zeros((0, 2))
        angles = np.append(lidar.angles, self._beyond)[blind]
        half = 0.5 * lidar.step * (_run_lengths(blind)[blind] + 1)
        distance = np.where(half < 0.5 * np.pi, HIDDEN / np.sin(np.minimum(half, 0.5 * np.pi)), HIDDEN)
        x, y, yaw = lidar.mount
        return np.stack([x + distance * np.cos(yaw + angles), y + distance * np.sin(yaw + angles)], axis=1)


def _run_lengths(flags: NDArray[np.bool_]) -> NDArray[np.int_]:
    """For each flag that is set how many in a row are, round the circle; 0 for the others, (n,)."""
    if flags.all():
        return np.full(len(flags), len(flags))
    first = int(np.flatnonzero(~flags)[0])
    turned = np.roll(flags, -first)  # begins with one that is not set
    edges = np.flatnonzero(np.diff(np.concatenate([[0], turned.astype(int), [0]])))
    lengths = np.zeros(len(flags), int)
    for start, end in edges.reshape(-1, 2):
        lengths[start:end] = end - start
    return np.roll(lengths, first)


def free_arc(points: Array, v: float, omega: float, discs: Iterable[tuple[float, float]]) -> float:
    """How far the origin gets along the arc of (v, omega) before SUPPORT points (n, 2) are in a disc [m].

    `discs` are how far ahead of the origin each is, and its radius. Points in one of them count where they lie ahead of
    the origin: the robot can leave those behind.
    """
    if v == 0.0 or len(points) < SUPPORT:
        return np.inf
    x, y = (points if v > 0.0 else -points).T
    far, within = np.full(len(points), np.inf), np.zeros(len(points), bool)
    for ahead, radius in discs:
        place = ahead if v > 0.0 else -ahead
        within |= (x - place) * (x - place) + y * y < radius * radius
        far = np.minimum(far, _until_met(x, y, abs(v), omega, place, radius))
    far = np.where(within, np.where(x > 0.0, 0.0, np.inf), far)
    return float(np.partition(far, SUPPORT - 1)[SUPPORT - 1])


def _until_met(x: Array, y: Array, v: float, omega: float, ahead: float, radius: float) -> Array:
    """How far the origin gets, at v > 0, until each point (n,) is on the edge of the disc [m].

    A disc off the origin has the velocity (v, ahead omega): its arc is another, and is turned to start along +x. With
    k = omega / v, about the arc's centre (0, 1/k) a point lies at the distance rho and, in the sense of the motion, the
    angle alpha. The disc's centre moves at r = 1/|k|, and its edge is at the point where

        cos(alpha - phi) = (r^2 + rho^2 - radius^2) / (2 r rho),   s = r phi.
    """
    if ahead != 0.0:
        speed = float(np.hypot(v, ahead * omega))
        c, s = v / speed, ahead * omega / speed
        x, y = c * (x - ahead) + s * y, c * y - s * (x - ahead)
        return _until_met(x, y, speed, omega, 0.0, radius) * v / speed
    curvature = omega / v
    with np.errstate(invalid="ignore", divide="ignore"):
        if abs(curvature) < STRAIGHT:
            return np.where((np.abs(y) < radius) & (x > 0.0), x - np.sqrt(np.maximum(radius**2 - y**2, 0.0)), np.inf)
        r, side = 1.0 / abs(curvature), np.sign(curvature)
        across = r - side * y
        rho = np.hypot(x, across)
        cosine = (r * r + rho * rho - radius * radius) / (2.0 * r * rho)
        phi = np.mod(np.arctan2(x, across) - np.arccos(np.clip(cosine, -1.0, 1.0)), 2.0 * np.pi)
        return np.where(np.abs(cosine) <= 1.0, r * phi, np.inf)
