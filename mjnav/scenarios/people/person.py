"""A person of a scene: the keys that people of every behaviour have."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from mjnav.config import Beside, Choice, Range, Variants, settle
from mjnav.errors import InvalidValue
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.people.avoiding import Orca, SocialForce
from mjnav.scenarios.people.replay import Replay
from mjnav.scenarios.people.straight import ConstantVelocity, StopAndGo
from mjnav.scenarios.people.temperament import IMPASSIVE, REGULAR, TEMPERAMENTS
from mjnav.scenarios.people.walkers import Waypoints
from mjnav.scenarios.ranges import MAX_TIME, Point

Behaviour = ConstantVelocity | StopAndGo | Waypoints | SocialForce | Orca | Replay
BEHAVIOURS: Mapping[str, type[Behaviour]] = MappingProxyType(
    {
        "constant_velocity": ConstantVelocity,
        "stop_and_go": StopAndGo,
        "waypoints": Waypoints,
        "social_force": SocialForce,
        "orca": Orca,
        "replay": Replay,
    }
)
# Behaviours that see the robot unless the file says otherwise.
SEEING: tuple[type, ...] = (BehaviourPlugin, SocialForce, Orca)
Walking = Annotated[Behaviour | BehaviourPlugin, Variants("behaviour", BEHAVIOURS, BehaviourPlugin)]

Moment = Annotated[float, Range(0.0, MAX_TIME, "s")]


@dataclass(frozen=True, slots=True)
class Person:
    """A walking person; the file has the behaviour's name in `behaviour` and its keys beside it.

    A key that may be None is not in a dump unless it was given: the cells of older studies keep their names.
    """

    start: Annotated[Point, "where the person stands at first"]
    behaviour: Annotated[Walking, Beside(), "how the person walks"]
    radius: Annotated[float, Range(0.1, 1.0, "m"), "of the round body"] = 0.3
    sees_robot: Annotated[
        bool | None,
        "whether the robot exists for this person; true by default for social_force, orca, behaviours of one's own and "
        "temperaments but regular and impassive, false for all others, which walk as if it were not there",
    ] = None
    temperament: Annotated[
        Annotated[str, Choice(tuple(TEMPERAMENTS))] | None,
        "how the person takes a robot that they see: regular by default",
    ] = None
    enters: Annotated[
        Moment | None, "when the person comes in, or as soon as the place is free; from the beginning by default"
    ] = None
    leaves: Annotated[Moment | None, "when the person goes; never by default"] = None

    def __post_init__(self):
        settle(self)
        if self.leaves is not None and self.leaves <= (self.enters or 0.0):
            raise InvalidValue("leaves", self.leaves, f"a time after enters ({self.enters or 0.0:g} s)")

    @property
    def from_the_start(self) -> bool:
        """Whether the person is there when the run begins."""
        return not self.enters

    @property
    def sees(self) -> bool:
        """Whether the robot exists for this person: `sees_robot`, or the default of behaviour and temperament."""
        if self.temperament == IMPASSIVE:
            return False
        if self.sees_robot is not None:
            return self.sees_robot
        return isinstance(self.behaviour, SEEING) or self.temperament not in (None, REGULAR)
