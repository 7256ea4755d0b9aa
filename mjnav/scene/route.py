"""The table [route] of a run file: the way that is planned for the robot."""

from dataclasses import dataclass
from typing import Annotated

from mjnav.scene.bodies import Wall
from mjnav.scene.ranges import MAX_WALLS
from mjnav.settings import Choice, Length, Range, Settled


@dataclass(frozen=True, slots=True)
class Route(Settled):
    """The way to the next point of the robot's route, on what it knows; without this table methods drive straight."""

    planner: Annotated[str, Choice(("shortest",)), "shortest: the shortest way, planned again where it is blocked"] = (
        "shortest"
    )
    clearance: Annotated[
        float, Range(0.0, 5.0, "m"), "that the way rather keeps from what stands: beside it costs 3 times its length"
    ] = 0.3
    ahead: Annotated[float, Range(0.2, 100.0, "m"), "how far along the way the point is to which methods drive"] = 1.5
    unknown: Annotated[
        float, Range(1.0, 100.0), "times its length that a way costs over floor that the robot's map does not know"
    ] = 1.0
    unseen: Annotated[
        Annotated[tuple[Wall, ...], Length(0, MAX_WALLS)] | None,
        "that floor, as walls lie; with unknown > 1 loading the file puts a map's free unknown cells here",
    ] = None
    patience: Annotated[float, Range(0.5, 1000.0, "s"), "without progress, after which the robot recovers"] = 10.0
