"""People who walk straight on."""

from dataclasses import dataclass
from math import hypot
from typing import Annotated

from mjnav.config import Range, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.ranges import MAX_TIME

PERIOD = 0.02  # [s] between people's decisions
MAX_WALKING_SPEED = 5.0  # [m/s]

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
