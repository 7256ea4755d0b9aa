"""The keys that only a random scene has: beside those of a person, a table, a pillar, a wall or the robot."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated, Any

from mjnav import config
from mjnav.config import Key, Length, Range, settle
from mjnav.errors import InvalidValue
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.layout.draws import Area
from mjnav.scenarios.people import BEHAVIOURS, MAX_WALKING_SPEED, Person
from mjnav.scenarios.ranges import MAX_BODIES, MAX_LENGTH, Angle, Size

_Number = Annotated[int, Range(0, MAX_BODIES)]
Count = Annotated[
    Annotated[tuple[_Number, _Number], "least, largest"] | _Number,
    "how many are drawn, or the least and the largest number of them",
]


@dataclass(frozen=True, slots=True)
class Drawn:
    """An entry that stands for several bodies."""

    count: Count

    def __post_init__(self):
        settle(self)
        if isinstance(self.count, tuple) and self.count[1] < self.count[0]:
            raise InvalidValue("count.1", self.count[1], f"a whole number from {self.count[0]} on")


@dataclass(frozen=True, slots=True)
class DrawnFurniture(Drawn):
    """Tables or pillars."""

    area: Annotated[Area | None, "in which `position` is drawn"] = None


@dataclass(frozen=True, slots=True)
class DrawnWalls(Drawn):
    """Walls; `to` may be given by a length and a direction."""

    area: Annotated[Area | None, "in which `from` is drawn"] = None
    length: Annotated[Size | None, "from `from` to `to`"] = None
    yaw: Annotated[Angle | None, "of the way from `from` to `to`, counter-clockwise from x"] = None


@dataclass(frozen=True, slots=True)
class TripAreas:
    """Where a trip begins and where it ends."""

    start: Annotated[Area, Key("from"), "where it begins"]
    end: Annotated[Area, Key("to"), "where it ends"]

    def __post_init__(self):
        settle(self)


@dataclass(frozen=True, slots=True)
class DrawnPeople(Drawn):
    """People; `velocity` may be given by a speed and a heading."""

    area: Annotated[Area | None, "in which `start` is drawn"] = None
    trips: Annotated[
        Annotated[tuple[TripAreas, ...], Length(1, MAX_BODIES)] | None,
        "of which one is drawn: `start` and the one waypoint lie in its areas",
    ] = None
    speed: Annotated[Annotated[float, Range(0.0, MAX_WALKING_SPEED, "m/s")] | None, "of people who have a velocity"] = (
        None
    )
    heading: Annotated[Angle | None, "of their velocity; drawn from all directions where only speed is given"] = None
    clear_of_robot: Annotated[
        Annotated[float, Range(0.0, MAX_LENGTH, "m")] | None,
        "least distance of `start` from the robot's, between the centres",
    ] = None


@dataclass(frozen=True, slots=True)
class DrawnRobot:
    """The robot's start and goal."""

    start_area: Annotated[Area | None, "in which x and y of `start` are drawn"] = None
    start_heading: Annotated[Angle | None, "of `start`; by default towards the first point of the route"] = None
    goal_area: Annotated[Area | None, "in which `goal` is drawn"] = None
    least_way: Annotated[
        float, Range(0.0, MAX_LENGTH, "m"), "least distance of the goal from the start, along a straight line"
    ] = 0.0

    def __post_init__(self):
        settle(self)


@dataclass(frozen=True, slots=True)
class Kind:
    """The entries of one array of a run file."""

    plain: type  # what an entry becomes
    drawn: type  # the keys that only a draft has
    place: str  # the key that `area` stands for
    redrawn: tuple[str, ...]  # keys that are drawn again where a body has no room

    def plain_keys(self) -> dict[str, Any]:
        """The types of the keys that a plain entry may have; of a person those of every behaviour, too."""
        found = {key: field.hint for key, field in config.keys(self.plain).items() if not field.beside}
        if self.plain is Person:
            for behaviour in BEHAVIOURS.values():
                found |= {key: field.hint for key, field in config.keys(behaviour).items()}
        return found

    def drawn_keys(self) -> dict[str, Any]:
        """The types of the keys that only a draft has."""
        return {key: field.hint for key, field in config.keys(self.drawn).items()}


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "walls": Kind(Wall, DrawnWalls, "from", ("area", "from", "to", "length", "yaw")),
        "tables": Kind(Table, DrawnFurniture, "position", ("area", "position", "yaw")),
        "pillars": Kind(Pillar, DrawnFurniture, "position", ("area", "position")),
        "people": Kind(Person, DrawnPeople, "start", ("area", "start", "trips", "waypoints")),
    }
)
