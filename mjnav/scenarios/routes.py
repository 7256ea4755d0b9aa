"""The routes that people walk, leg by leg.

A person who walks from waypoint to waypoint walks straight where the straight leg stays clear of every wall, table and
pillar by their radius. Otherwise the leg is planned around them (`mjnav.scenarios.ways`); a leg without any way is
refused. The last REACHED before a waypoint does not count, because the person turns there. A person with a constant
velocity walks until something stops them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import hypot

from mjnav.errors import InvalidValue
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.people import REACHED, Person, Walker
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.shapes import Box, Disc, Strip, met_by_people

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


def check_routes(
    people: Sequence[Person], walls: Sequence[Wall], tables: Sequence[Table], pillars: Sequence[Pillar]
) -> None:
    """Raises InvalidValue for the first waypoint to which no way leads."""
    for leg in planned_legs(people, walls, tables, pillars):
        if leg.points is None:
            radius = people[leg.person].radius
            allowed = f"a point to which a way leads from {leg.start}, {radius:g} m clear of {leg.in_the_way}"
            raise InvalidValue(f"people.{leg.person}.waypoints.{leg.waypoint}", leg.end, allowed)


def check_trips(
    people: Sequence[Person], walls: Sequence[Wall], tables: Sequence[Table], pillars: Sequence[Pillar]
) -> None:
    """Raises InvalidValue for the first area of a trip in which walls and furniture leave no place for the person."""
    bodies = met_by_people(walls, tables, pillars)
    for i, person in enumerate(people):
        trips = person.behaviour.trips if isinstance(person.behaviour, Walker) else None
        for k, trip in enumerate(trips or ()):
            for key, ((x0, y0), (x1, y1)) in (("from", trip.start), ("to", trip.goal)):
                points = [(x0 + u * (x1 - x0), y0 + v * (y1 - y0)) for u in _SHARES for v in _SHARES]
                if not any(all(body.distance(point) >= person.radius for body in bodies) for point in points):
                    allowed = f"an area with room for the person, {person.radius:g} m clear of walls and furniture"
                    raise InvalidValue(f"people.{i}.trips.{k}.{key}", ((x0, y0), (x1, y1)), allowed)


def planned_legs(
    people: Sequence[Person], walls: Sequence[Wall], tables: Sequence[Table], pillars: Sequence[Pillar]
) -> Iterator[Leg]:
    """The legs of all who have waypoints and move, in order."""
    bodies = met_by_people(walls, tables, pillars)
    ways = None
    for i, person in enumerate(people):
        walk = person.behaviour
        if not isinstance(walk, Walker) or walk.speed == 0.0:
            continue
        for index, start, end in walk.legs(person.start):
            body = _first_in_the_way(start, end, person.radius, bodies)
            if body is None:
                yield Leg(i, index, start, end, "", (end,))
                continue
            if ways is None:
                from mjnav.scenarios.ways import ways_of  # loads compiled code, which few scenes need here

                ways = ways_of(tuple(walls), tuple(tables), tuple(pillars))
            found = ways.plan(start, end, person.radius)
            if found is None:
                nearest = min(bodies, key=lambda body: body.distance(end))
                body = nearest if nearest.distance(end) < person.radius - REACHED else body
                yield Leg(i, index, start, end, body.key, None)
            else:
                yield Leg(i, index, start, end, body.key, tuple((x, y) for x, y in found.tolist()))


def _first_in_the_way(start: Point, end: Point, radius: float, bodies: Sequence[Disc | Box]) -> Disc | Box | None:
    """What a disc meets on the straight leg, the body nearest to its start; None where the leg is free."""
    length = hypot(end[0] - start[0], end[1] - start[1])
    share = min(REACHED / length, 0.5) if length > 0.0 else 0.0
    strip = Strip(start, end, share, radius)
    return min((body for body in bodies if strip.meets(body)), key=lambda body: body.distance(start), default=None)
