"""People who walk from waypoint to waypoint."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from mjnav.config import Length, Range, settle
from mjnav.scenarios.people.straight import MAX_WALKING_SPEED
from mjnav.scenarios.ranges import MAX_POINTS, Point

REACHED = 0.2  # [m] from a waypoint on the way at which the next one counts


@dataclass(frozen=True, slots=True)
class Walker:
    """Whoever walks from point to point; with `loop` from the last back to the first."""

    waypoints: Annotated[tuple[Point, ...], Length(1, MAX_POINTS), "points to walk through, in order"]
    speed: Annotated[float, Range(0.0, MAX_WALKING_SPEED, "m/s"), "between the points"] = 1.0
    loop: Annotated[bool, "walk on from the last point to the first"] = True

    def __post_init__(self):
        settle(self)

    def legs(self, start: Point) -> list[tuple[int, Point, Point]]:
        """The straight legs of the way from `start`: index of the waypoint that each leads to, and both ends."""
        back = self.waypoints[:1] if self.loop and len(self.waypoints) > 1 else ()
        points = (start, *self.waypoints, *back)
        return [(i % len(self.waypoints), *leg) for i, leg in enumerate(pairwise(points))]


@dataclass(frozen=True, slots=True)
class Waypoints(Walker):
    """Walks from point to point; with `loop` from the last back to the first, else stands there."""

    def __post_init__(self):
        settle(self)
