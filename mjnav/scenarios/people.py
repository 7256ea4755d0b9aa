"""The people of a scene and how they walk."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import hypot
from types import MappingProxyType

from mjnav.errors import InvalidValue
from mjnav.scenarios.ranges import MAX_POINTS, MAX_TIME, Point, check_coordinates, check_count, check_range

MAX_WALKING_SPEED = 5.0  # [m/s]
REACHED = 0.2  # [m] from a waypoint on the way at which the next one counts


def _check_velocity(velocity: Point) -> None:
    if not hypot(*velocity) <= MAX_WALKING_SPEED:
        raise InvalidValue("velocity", velocity, f"at most {MAX_WALKING_SPEED:g} m/s")


@dataclass(frozen=True, slots=True)
class ConstantVelocity:
    """Walks straight on, until something is in the way."""

    velocity: Point

    def __post_init__(self):
        _check_velocity(self.velocity)


@dataclass(frozen=True, slots=True)
class StopAndGo:
    """Walks for `go_time` [s], stands for `stop_time` [s], and so on, until something is in the way."""

    velocity: Point
    go_time: float = 2.0
    stop_time: float = 1.0

    def __post_init__(self):
        _check_velocity(self.velocity)
        check_range("go_time", self.go_time, 1e-3, MAX_TIME)
        check_range("stop_time", self.stop_time, 0.0, MAX_TIME)


@dataclass(frozen=True, slots=True)
class Waypoints:
    """Walks from point to point; with `loop` from the last back to the first, else stands there."""

    waypoints: tuple[Point, ...]
    speed: float = 1.0
    loop: bool = True

    def __post_init__(self):
        if not self.waypoints:
            raise InvalidValue("waypoints", self.waypoints, "at least one point")
        check_count("waypoints", self.waypoints, MAX_POINTS)
        for point in self.waypoints:
            check_coordinates("waypoints", point)
        check_range("speed", self.speed, 0.0, MAX_WALKING_SPEED)

    def legs(self, start: Point) -> list[tuple[int, Point, Point]]:
        """The straight legs of the way from `start`: index of the waypoint that each leads to, and both ends."""
        back = self.waypoints[:1] if self.loop and len(self.waypoints) > 1 else ()
        points = (start, *self.waypoints, *back)
        return [(i % len(self.waypoints), *leg) for i, leg in enumerate(pairwise(points))]


Behaviour = ConstantVelocity | StopAndGo | Waypoints
BEHAVIOURS: Mapping[str, type[Behaviour]] = MappingProxyType(
    {"constant_velocity": ConstantVelocity, "stop_and_go": StopAndGo, "waypoints": Waypoints}
)


@dataclass(frozen=True, slots=True)
class Person:
    """A walking person; the file has the behaviour's name in `behaviour` and its keys beside it."""

    start: Point
    behaviour: Behaviour
    radius: float = 0.3

    def __post_init__(self):
        check_coordinates("start", self.start)
        check_range("radius", self.radius, 0.1, 1.0)
