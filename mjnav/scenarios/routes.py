"""Whether people can walk their routes.

A person who walks from waypoint to waypoint walks straight where the straight leg stays clear of every wall, table and
pillar by their radius. Otherwise the leg is planned around them (`mjnav.scenarios.ways`); a leg without any way is
refused. The last REACHED before a waypoint does not count, because the person turns there. A person with a constant
velocity walks until something stops them.
"""

from collections.abc import Sequence
from math import hypot

from mjnav.errors import InvalidValue
from mjnav.scenarios.people import REACHED
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.shapes import Box, Disc, Strip
from mjnav.scenarios.spec import Scenario, Waypoints


def check_routes(scenario: Scenario, bodies: Sequence[Disc | Box]) -> None:
    """Raises InvalidValue for the first waypoint to which no way leads; people walk around all of `bodies`."""
    ways = None
    for i, person in enumerate(scenario.people):
        walk = person.behaviour
        if not isinstance(walk, Waypoints) or walk.speed == 0.0:
            continue
        for index, start, end in walk.legs(person.start):
            blocking = in_the_way(start, end, person.radius, bodies)
            if blocking is None:
                continue
            if ways is None:
                from mjnav.scenarios.ways import Ways  # loads compiled code, which few scenes need here

                ways = Ways(scenario)
            if ways.plan(start, end, person.radius) is None:
                allowed = f"a point to which a way leads from {start}, {person.radius:g} m clear of {blocking.key}"
                raise InvalidValue(f"people.{i}.waypoints.{index}", end, allowed)


def in_the_way(start: Point, end: Point, radius: float, bodies: Sequence[Disc | Box]) -> Disc | Box | None:
    """What a disc meets on the straight leg, the body nearest to its start; None where the leg is free."""
    length = hypot(end[0] - start[0], end[1] - start[1])
    share = min(REACHED / length, 0.5) if length > 0.0 else 0.0
    strip = Strip(start, end, share, radius)
    return min((body for body in bodies if strip.meets(body)), key=lambda body: body.distance(start), default=None)
