"""Checks between the parts of a scenario: bodies that overlap, goals and waypoints that cannot be reached.

A body is a disc or a rectangle seen from above. Walls may touch and cross (corners), a pillar may stand in a wall (half
column), and bodies may touch; every other overlap is refused. The robot fits under tables and meets their legs only;
people, and bodies as high as the table, meet its top.

A person who walks from waypoint to waypoint stays clear of every wall by their radius on each straight leg; otherwise
they would stand in front of the wall for the rest of the run. The last REACHED before a waypoint does not count,
because the person turns there. A person with a constant velocity walks until a wall stops them.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, sin

from mjnav.errors import InvalidValue
from mjnav.scenarios.bodies import Table, Wall
from mjnav.scenarios.people import REACHED
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Person, Scenario, Waypoints

_TOUCH = 1e-9  # [m]; bodies nearer than this touch


@dataclass(frozen=True, slots=True)
class _Disc:
    key: str
    centre: Point
    radius: float
    height: float = 2.0

    def distance(self, point: Point) -> float:
        """From the surface to a point [m], negative inside."""
        return hypot(point[0] - self.centre[0], point[1] - self.centre[1]) - self.radius


@dataclass(frozen=True, slots=True)
class _Box:
    key: str
    centre: Point
    yaw: float
    half: Point  # half the sides
    height: float

    def distance(self, point: Point) -> float:
        """From the surface to a point [m], negative inside."""
        c, s = cos(self.yaw), sin(self.yaw)
        x, y = point[0] - self.centre[0], point[1] - self.centre[1]
        dx, dy = abs(c * x + s * y) - self.half[0], abs(c * y - s * x) - self.half[1]
        return hypot(max(dx, 0.0), max(dy, 0.0)) + min(max(dx, dy), 0.0)

    def corners(self) -> list[Point]:
        c, s = cos(self.yaw), sin(self.yaw)
        ends = [(u * self.half[0], v * self.half[1]) for u in (-1, 1) for v in (-1, 1)]
        return [(self.centre[0] + c * x - s * y, self.centre[1] + s * x + c * y) for x, y in ends]

    def overlaps(self, other: "_Box") -> bool:
        """Whether the boxes overlap: no side of either separates them."""
        for yaw in (self.yaw, other.yaw):
            for nx, ny in ((cos(yaw), sin(yaw)), (-sin(yaw), cos(yaw))):
                mine, theirs = ([nx * x + ny * y for x, y in box.corners()] for box in (self, other))
                if max(mine) < min(theirs) + _TOUCH or max(theirs) < min(mine) + _TOUCH:
                    return False
        return True


def check(scenario: Scenario) -> None:
    """Raises InvalidValue for the first pair of bodies that overlap, and for a goal that cannot be reached."""
    robot = scenario.robot
    walls = [_wall_box(f"walls.{i}", wall) for i, wall in enumerate(scenario.walls)]
    tops = [_table_box(f"tables.{i}", table) for i, table in enumerate(scenario.tables)]
    legs = [leg for i, table in enumerate(scenario.tables) for leg in _legs(f"tables.{i}", table)]
    pillars = [_Disc(f"pillars.{i}", p.position, p.radius, p.height) for i, p in enumerate(scenario.pillars)]
    people = [_Disc(f"people.{i}", p.start, p.radius) for i, p in enumerate(scenario.people)]

    for i, (top, table) in enumerate(zip(tops, scenario.tables, strict=True)):
        for other in (*(wall for wall in walls if wall.height >= top.height), *tops[:i]):
            if top.overlaps(other):
                raise InvalidValue(f"{top.key}.position", table.position, f"a place clear of {other.key}")
        for leg in _legs(top.key, table):
            for wall in walls:
                _keep_apart(leg, wall, f"{top.key}.position", table.position)
    for i, pillar in enumerate(pillars):
        for other in (*pillars[:i], *(top for top in tops if pillar.height >= top.height), *legs):
            _keep_apart(pillar, other, f"{pillar.key}.position", pillar.centre)
    for i, person in enumerate(people):
        for other in (*walls, *tops, *pillars, *people[:i]):
            _keep_apart(person, other, f"{person.key}.start", person.centre)
    for i, person in enumerate(scenario.people):
        _check_route(f"people.{i}", person, walls)
    body = _Disc("robot", robot.start[:2], robot.radius)
    for other in (*walls, *legs, *pillars, *people):
        _keep_apart(body, other, "robot.start", robot.start)
    for i, point in enumerate(robot.route):
        for other in (*walls, *legs, *pillars):
            room = other.distance(point)
            if room <= 0.0 or room + robot.goal_tolerance < robot.radius:
                key = "robot.goal" if robot.goal is not None else f"robot.waypoints.{i}"
                allowed = f"a point that the robot can reach to {robot.goal_tolerance:g} m, clear of {other.key}"
                raise InvalidValue(key, point, allowed)


def _keep_apart(disc: _Disc, other: _Disc | _Box, key: str, found: object) -> None:
    missing = disc.radius - other.distance(disc.centre)
    if missing > _TOUCH:
        raise InvalidValue(key, found, f"a place clear of {other.key}, {missing:.3f} m further away")


def _check_route(key: str, person: Person, walls: list[_Box]) -> None:
    walk = person.behaviour
    if not isinstance(walk, Waypoints) or walk.speed == 0.0:
        return
    for index, start, end in walk.legs(person.start):
        length = hypot(end[0] - start[0], end[1] - start[1])
        share = min(REACHED / length, 0.5) if length > 0.0 else 0.0
        way = _Way(start, end, share, person.radius)
        for wall in walls:
            if way.meets(wall):
                allowed = f"a point with a straight way from {start} that stays {person.radius:g} m clear of {wall.key}"
                raise InvalidValue(f"{key}.waypoints.{index}", end, allowed)


class _Way:
    """The area that a disc sweeps between two points; a share of the length is left out at both ends."""

    def __init__(self, start: Point, end: Point, share: float, radius: float):
        (x0, y0), (x1, y1) = start, end
        dx, dy = x1 - x0, y1 - y0
        self._ends = ((x0 + share * dx, y0 + share * dy), (x1 - share * dx, y1 - share * dy))
        self._reach, self._radius = (0.5 - share) * hypot(dx, dy), radius
        centre = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        self._between = _Box("", centre, atan2(dy, dx), (self._reach, radius), 0.0)

    def meets(self, box: _Box) -> bool:
        """Whether the area overlaps a box: its rectangle does, or the disc at one of its ends."""
        if box.distance(self._between.centre) > self._reach + self._radius:
            return False
        missing = self._radius - min(map(box.distance, self._ends))
        return missing > _TOUCH or self._between.overlaps(box)


def _wall_box(key: str, wall: Wall) -> _Box:
    (x0, y0), (x1, y1) = wall.start, wall.end
    half = (0.5 * hypot(x1 - x0, y1 - y0), 0.5 * wall.thickness)
    return _Box(key, (0.5 * (x0 + x1), 0.5 * (y0 + y1)), atan2(y1 - y0, x1 - x0), half, wall.height)


def _table_box(key: str, table: Table) -> _Box:
    half = (0.5 * table.size[0] + table.leg_radius, 0.5 * table.size[1] + table.leg_radius)
    return _Box(key, table.position, table.yaw, half, table.height)


def _legs(key: str, table: Table) -> Iterator[_Disc]:
    for x, y in table.legs:
        yield _Disc(key, (float(x), float(y)), table.leg_radius, table.height)
