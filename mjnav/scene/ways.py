"""Floors and ways in a scene: the obstacles of the robot and of people, and people's planned ways around them.

The check of a run file and the people in a run plan the same ways around walls and furniture.

A route is planned leg by leg. A person who walks from waypoint to waypoint walks straight where the straight leg stays
clear of every wall, table and pillar by their radius. Otherwise the leg is planned around them (`Ways`); a leg without
any way is refused. The last REACHED before a waypoint does not count, because the person turns there. A person with a
constant velocity walks until something stops them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, hypot

import numpy as np

from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.geometry.floor import Floor
from mjnav.geometry.shortest_way import EXCESS, WayMap
from mjnav.messages import Array
from mjnav.scene.bodies import B, Box, Disc, Pillar, Strip, Table, Wall, met_by_people, met_by_robot
from mjnav.scene.people import REACHED, Walker
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Scenario

# ------------------------------------------------------------------------------------------- floors


def floor_of(shapes: Iterable[Disc | Box]) -> Floor:
    """The floor on which they stand; discs come before boxes, both in their order."""
    shapes = list(shapes)
    discs = [(*disc.centre, disc.radius) for disc in shapes if isinstance(disc, Disc)]
    boxes = [(*box.centre, *box.along, *box.half) for box in shapes if isinstance(box, Box)]
    return Floor(np.array(discs, float).reshape(-1, 3), np.array(boxes, float).reshape(-1, 6))


def floor_of_robot(walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> Floor:
    """Legs, then pillars, as discs; walls as boxes."""
    return floor_of(met_by_robot(walls, tables, pillars))


def floor_of_people(walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> Floor:
    """Pillars as discs; walls, then tables' tops, as boxes."""
    return floor_of(met_by_people(walls, tables, pillars))


def floor_of_lidar(scenario: Scenario) -> Floor:
    """What the robot's map has at the height of the lidar: legs, then pillars, as discs; walls as boxes."""
    known, height = scenario.known_bodies, scenario.sensors.scanner.height
    return floor_of_robot(_high(known.walls, height), _high(known.tables, height), _high(known.pillars, height))


def _high(bodies: Iterable[B], height: float) -> list[B]:
    return [body for body in bodies if body.height > height]


# ------------------------------------------------------------------------------------ people's ways


MARGIN, STEP = 0.02, 0.05  # [m] least distance from bodies on the way, which is rounded up so that people share maps
NARROW_MARGIN = 0.005  # [m] where there is no way with more
_MOVED = REACHED - 0.01  # [m] that a person may end beside a waypoint that is too near to a body


class Ways(Constant):
    """The ways of all people of a scene; what one of them needed serves the next, and copies of a simulation."""

    def __init__(self, floor: Floor):
        """`floor` has what people walk around: `floor_of_people`."""
        self.floor = floor
        self._maps: dict[float, WayMap] = {}

    def maps(self, radius: float) -> Iterator[WayMap]:
        """For a person of `radius` [m]: with room to spare, then, where that leads nowhere, as narrow as can be."""
        yield self._map(STEP * ceil((radius + MARGIN) / STEP), EXCESS)
        yield self._map(radius + NARROW_MARGIN, NARROW_MARGIN)

    def _map(self, reach: float, excess: float) -> WayMap:
        if reach not in self._maps:
            self._maps[reach] = WayMap(self.floor, reach, excess)
        return self._maps[reach]

    def plan(self, start: Point, goal: Point, radius: float) -> Array | None:
        """The points (k, 2) [m] of the shortest way after its start, or None; it may end REACHED beside the goal."""
        for ways in self.maps(radius):
            begin, end = ways.anchor(start), end_of(ways, goal)
            if begin is not None and end is not None:
                found = ways.way(begin, end)
                if found is not None:
                    return found
        return None


@lru_cache(maxsize=16)
def ways_of(walls: tuple[Wall, ...], tables: tuple[Table, ...], pillars: tuple[Pillar, ...]) -> Ways:
    """The ways of a scene: a run file's check, every behaviour and the episodes of a sweep share their maps."""
    return Ways(floor_of_people(walls, tables, pillars))


def end_of(ways: WayMap, goal: Point) -> Array | None:
    """Where a way to a waypoint ends, (2,) [m]: there, or beside it where a body stands; None where it is too near."""
    end = ways.anchor(goal)
    return None if end is None or hypot(*(end - np.asarray(goal))) > _MOVED else end


# ---------------------------------------------------------------------- people's routes, leg by leg


_SHARES = tuple(0.125 * k for k in range(9))  # of an area's sides, at which room is looked for


@dataclass(frozen=True, slots=True)
class Leg:
    """The way of a person to one waypoint."""

    person: int
    waypoint: int
    start: Point
    end: Point
    in_the_way: str  # the key of the first body on the straight leg, or of the one over its end; empty where it is free
    points: tuple[Point, ...] | None  # walked to one after another; None where there is no way


def check_routes(scenario: Scenario) -> None:
    """Raises InvalidValue for the first waypoint to which no way leads."""
    for leg in planned_legs(scenario):
        if leg.points is None:
            radius = scenario.people[leg.person].radius
            allowed = f"a point to which a way leads from {leg.start}, {radius:g} m clear of {leg.in_the_way}"
            raise InvalidValue(f"people.{leg.person}.waypoints.{leg.waypoint}", leg.end, allowed)


def check_trips(scenario: Scenario) -> None:
    """Raises InvalidValue for the first area of a trip in which walls and furniture leave no place for the person."""
    bodies = met_by_people(scenario.walls, scenario.tables, scenario.pillars)
    for i, person in enumerate(scenario.people):
        trips = person.behaviour.trips if isinstance(person.behaviour, Walker) else None
        for k, trip in enumerate(trips or ()):
            for key, ((x0, y0), (x1, y1)) in (("from", trip.start), ("to", trip.goal)):
                points = [(x0 + u * (x1 - x0), y0 + v * (y1 - y0)) for u in _SHARES for v in _SHARES]
                if not any(all(body.distance(point) >= person.radius for body in bodies) for point in points):
                    allowed = f"an area with room for the person, {person.radius:g} m clear of walls and furniture"
                    raise InvalidValue(f"people.{i}.trips.{k}.{key}", ((x0, y0), (x1, y1)), allowed)


def planned_legs(scenario: Scenario) -> Iterator[Leg]:
    """The legs of all who have waypoints and move, in order."""
    bodies = met_by_people(scenario.walls, scenario.tables, scenario.pillars)
    for i, person in enumerate(scenario.people):
        walk = person.behaviour
        if not isinstance(walk, Walker) or walk.speed == 0.0:
            continue
        for index, start, end in walk.legs(person.start):
            body = _first_in_the_way(start, end, person.radius, bodies)
            if body is None:
                yield Leg(i, index, start, end, "", (end,))
                continue
            points = ways_of(scenario.walls, scenario.tables, scenario.pillars).plan(start, end, person.radius)
            if points is None:
                nearest = min(bodies, key=lambda body: body.distance(end))
                body = nearest if nearest.distance(end) < person.radius - REACHED else body
                yield Leg(i, index, start, end, body.key, None)
            else:
                yield Leg(i, index, start, end, body.key, tuple((x, y) for x, y in points.tolist()))


def _first_in_the_way(start: Point, end: Point, radius: float, bodies: Sequence[Disc | Box]) -> Disc | Box | None:
    """What a disc meets on the straight leg, the body nearest to its start; None where the leg is free."""
    length = hypot(end[0] - start[0], end[1] - start[1])
    strip = Strip(start, end, min(REACHED / length, 0.5) if length > 0.0 else 0.0, radius)
    return min((body for body in bodies if strip.meets(body)), key=lambda body: body.distance(start), default=None)
