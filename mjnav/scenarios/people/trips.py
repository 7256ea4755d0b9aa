"""Where people who come again begin and end their ways."""

from dataclasses import dataclass
from typing import Annotated

from mjnav.config import Key, settle
from mjnav.scenarios.ranges import Point

STAY, LEAVE, AGAIN = "stay", "leave", "again"
AT_END = (STAY, LEAVE, AGAIN)
AGAIN_WITHIN = 2.0  # [m] from the goal, as in the corridor of mpc_planner (tud-amr)
CLEAR_OF_ROBOT = 5.0  # [m], likewise

Area = tuple[Point, Point]


@dataclass(frozen=True, slots=True)
class Trip:
    """A way from a random point of one area to a random point of another."""

    start: Annotated[Area, Key("from"), "two opposite corners of the area where the way begins"]
    goal: Annotated[Area, Key("to"), "two opposite corners of the area where it ends"]

    def __post_init__(self):
        settle(self)
