"""People who walk from waypoint to waypoint."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

from mjnav.config import Choice, Length, Range, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.people.straight import MAX_WALKING_SPEED
from mjnav.scenarios.people.trips import AGAIN, AGAIN_WITHIN, AT_END, CLEAR_OF_ROBOT, STAY, Trip
from mjnav.scenarios.ranges import MAX_LENGTH, MAX_POINTS, Point

REACHED = 0.2  # [m] from a waypoint on the way at which the next one counts
MAX_TRIPS = 100
Distance = Annotated[float, Range(0.0, MAX_LENGTH, "m")]


@dataclass(frozen=True, slots=True)
class Walker:
    """Whoever walks from point to point.

    A key that may be None is not in a dump unless it was given: the cells of older studies keep their names.
    """

    waypoints: Annotated[tuple[Point, ...], Length(1, MAX_POINTS), "points to walk through, in order"]
    speed: Annotated[float, Range(0.0, MAX_WALKING_SPEED, "m/s"), "between the points"] = 1.0
    loop: Annotated[bool, "walk on from the last point to the first; false by default where at_end is given"] = True
    at_end: Annotated[
        Annotated[str, Choice(AT_END)] | None,
        "at the last point: stay there (the default), leave the scene, or leave and come again on one of the trips",
    ] = None
    trips: Annotated[
        Annotated[tuple[Trip, ...], Length(1, MAX_TRIPS)] | None,
        'ways of at_end = "again", of which each has the same chance',
    ] = None
    again_within: Annotated[
        Distance | None, f"from the last point, where the person leaves to come again; {AGAIN_WITHIN:g} by default"
    ] = None
    clear_of_robot: Annotated[
        Distance | None, f"between robot and person, at least, where one comes again; {CLEAR_OF_ROBOT:g} by default"
    ] = None

    def __post_init__(self):
        settle(self)
        if self.loop and self.at_end is not None:
            raise InvalidValue("at_end", self.at_end, "nothing beside loop = true: who loops has no end")
        if self.at_end == AGAIN and self.trips is None:
            raise InvalidValue("trips", None, 'an array of tables with from and to; at_end = "again" requires it')
        for key in ("trips", "again_within", "clear_of_robot"):
            if self.at_end != AGAIN and getattr(self, key) is not None:
                found = f"{len(self.trips)} of them" if key == "trips" and self.trips else getattr(self, key)
                raise InvalidValue(key, found, 'nothing without at_end = "again"')

    @staticmethod
    def dependent_defaults(arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Who is told what to do at the end has one."""
        return {"loop": arguments.get("at_end") is None}

    @property
    def leaves_within(self) -> float | None:
        """The distance from the last point at which the person leaves the scene [m]; None for those who do not."""
        if self.at_end in (None, STAY):
            return None
        return (AGAIN_WITHIN if self.again_within is None else self.again_within) if self.trips else REACHED

    def legs(self, start: Point) -> list[tuple[int, Point, Point]]:
        """The straight legs of the way from `start`: index of the waypoint that each leads to, and both ends."""
        back = self.waypoints[:1] if self.loop and len(self.waypoints) > 1 else ()
        points = (start, *self.waypoints, *back)
        return [(i % len(self.waypoints), *leg) for i, leg in enumerate(pairwise(points))]


@dataclass(frozen=True, slots=True)
class Waypoints(Walker):
    """Walks from point to point; with `loop` from the last back to the first, else stands there."""
