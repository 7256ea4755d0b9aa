"""The people of a scene and how they walk."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import hypot
from types import MappingProxyType
from typing import Annotated

from mjnav.config import Beside, Length, Range, Variants, settle
from mjnav.errors import InvalidValue
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.ranges import MAX_POINTS, MAX_TIME, Point

MAX_WALKING_SPEED = 5.0  # [m/s]
REACHED = 0.2  # [m] from a waypoint on the way at which the next one counts

Component = Annotated[float, Range(-MAX_WALKING_SPEED, MAX_WALKING_SPEED, "m/s")]
Velocity = tuple[Component, Component]


def _check_speed(velocity: Velocity) -> None:
    if not hypot(*velocity) <= MAX_WALKING_SPEED:
        raise InvalidValue("velocity", velocity, f"at most {MAX_WALKING_SPEED:g} m/s")


@dataclass(frozen=True, slots=True)
class ConstantVelocity:
    """Walks straight on, until something is in the way."""

    velocity: Annotated[Velocity, "along x and y"]

    def __post_init__(self):
        settle(self)
        _check_speed(self.velocity)


@dataclass(frozen=True, slots=True)
class StopAndGo:
    """Walks for `go_time`, stands for `stop_time`, and so on, until something is in the way."""

    velocity: Annotated[Velocity, "along x and y, while walking"]
    go_time: Annotated[float, Range(1e-3, MAX_TIME, "s"), "walked before each stop"] = 2.0
    stop_time: Annotated[float, Range(0.0, MAX_TIME, "s"), "of each stop"] = 1.0

    def __post_init__(self):
        settle(self)
        _check_speed(self.velocity)


@dataclass(frozen=True, slots=True)
class Waypoints:
    """Walks from point to point; with `loop` from the last back to the first, else stands there."""

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


Behaviour = ConstantVelocity | StopAndGo | Waypoints
BEHAVIOURS: Mapping[str, type[Behaviour]] = MappingProxyType(
    {"constant_velocity": ConstantVelocity, "stop_and_go": StopAndGo, "waypoints": Waypoints}
)
Walking = Annotated[Behaviour | BehaviourPlugin, Variants("behaviour", BEHAVIOURS, BehaviourPlugin)]


@dataclass(frozen=True, slots=True)
class Person:
    """A walking person; the file has the behaviour's name in `behaviour` and its keys beside it."""

    start: Annotated[Point, "where the person stands at first"]
    behaviour: Annotated[Walking, Beside(), "how the person walks"]
    radius: Annotated[float, Range(0.1, 1.0, "m"), "of the round body"] = 0.3

    def __post_init__(self):
        settle(self)
