"""Entries of a random scene: the keys that only a random scene has, and the plain entries that are drawn from them.

These keys stand beside those of a person, a table, a pillar, a wall or the robot. An `Entry` checks what its values may
be, and gives plain entries for the bodies that it stands for.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import cos, pi, sin
from types import MappingProxyType
from typing import Annotated, Any

from mjnav import config
from mjnav.config import Choice, Key, Length, Range, below, settle
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.layout.values import ANY, Area, Streams, check_value, draw_count, draw_point, draw_value, is_drawn
from mjnav.scenarios.people import AGAIN, BEHAVIOURS, MAX_WALKING_SPEED, ConstantVelocity, Person, StopAndGo
from mjnav.scenarios.ranges import MAX_BODIES, MAX_LENGTH, Angle, Size

# ---------------------------------------------------------------------------- keys of random scenes


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


# ----------------------------------------------------------------------------------------- an entry


_STRAIGHT = (ConstantVelocity, StopAndGo)  # whose velocity a speed and a heading stand for


@dataclass(frozen=True, slots=True)
class Entry:
    """A table of a draft under its key, "people.2"."""

    kind: Kind
    key: str
    table: Mapping[str, Any]

    @property
    def is_drawn(self) -> bool:
        """Whether it says how many bodies it stands for. Raises InvalidValue for draws without a number."""
        if "count" in self.table:
            return True
        plain = self._plain_keys()
        if any(is_drawn(plain[key], value) for key, value in self.table.items() if key in plain):
            raise InvalidValue(f"{self.key}.count", None, "count = 1 or more, in an entry that draws values")
        return False

    def check(self) -> None:
        """Raises InvalidValue, below the entry's key, for a key that is not known and for what may not be drawn."""
        hints = {**self.kind.drawn_keys(), **self._plain_keys()}
        for key, value in self.table.items():
            if key not in hints and not self._plugins():
                raise unknown_name(key, key, hints)
            with below(key):
                check_value(hints.get(key, ANY), value)
        config.read(self.kind.drawn, {"count": self.table["count"]})
        for one, other in (("area", self.kind.place), ("area", "trips"), ("length", "to")):
            if one in self.table and other in self.table:
                raise InvalidValue(one, self.table[one], f"{one} or {other}, not both")

    def num(self, streams: Streams) -> int:
        """How many bodies the entry stands for in this layout."""
        count = self.table["count"]
        return draw_count(tuple(count) if isinstance(count, list) else count, streams(f"{self.key}.count"))

    def bodies(self, number: int, streams: Streams) -> Iterator[dict[str, Any]]:
        """Plain tables of body `number`, each time in another place, without end."""

        def own(part: str) -> Any:
            return streams(f"{self.key}.{number}.{part}")

        hints = {**self.kind.drawn_keys(), **self._plain_keys()}

        def value(key: str) -> Any:
            if key in ("count", "area", "trips"):
                return self.table[key]
            return draw_value(hints.get(key, ANY), self.table[key], key, own)

        fixed = {key: value(key) for key in self.table if key not in self.kind.redrawn}
        while True:
            yield self._plain({**fixed, **{key: value(key) for key in self.kind.redrawn if key in self.table}}, own)

    def _plain(self, values: dict[str, Any], streams: Streams) -> dict[str, Any]:
        """The plain table for drawn values."""
        values.pop("count", None)
        if "area" in values:
            values[self.kind.place] = draw_point(values.pop("area"), streams("area"))
        if "from" in values and "length" in values:
            length, yaw = values.pop("length"), values.pop("yaw", 0.0)
            values["to"] = [values["from"][0] + length * cos(yaw), values["from"][1] + length * sin(yaw)]
        return self._person(values, streams) if self.kind.plain is Person else values

    def _person(self, values: dict[str, Any], streams: Streams) -> dict[str, Any]:
        behaviour = BEHAVIOURS.get(str(values.get("behaviour")))
        if values.get("at_end") != AGAIN:  # who comes again draws further trips, in the run
            values.pop("clear_of_robot", None)
        if self._has_trip:
            trips = values["trips"] if values.get("at_end") == AGAIN else values.pop("trips")
            trip = trips[int(streams("trips").integers(len(trips)))]
            values["start"] = draw_point(trip["from"], streams("trips.from"))
            values.setdefault("waypoints", [draw_point(trip["to"], streams("trips.to"))])
        if behaviour in _STRAIGHT and "velocity" not in values and "speed" in values:
            heading = values.get("heading")
            heading = float(streams("heading").uniform(-pi, pi)) if heading is None else heading
            values["velocity"] = [values["speed"] * cos(heading), values["speed"] * sin(heading)]
        values.pop("heading", None)
        own = set() if behaviour is None else set(config.keys(behaviour))
        drop = _only_of_other_behaviours(own) if isinstance(self.table.get("behaviour"), Mapping) else set()
        drop |= {"speed"} if behaviour in _STRAIGHT else set()
        return {key: value for key, value in values.items() if key not in drop}

    def _plain_keys(self) -> dict[str, Any]:
        found = self.kind.plain_keys()
        if self.kind.plain is Person:
            found["behaviour"] = Annotated[str, Choice((*BEHAVIOURS, *self._plugins()))]
        return found

    @property
    def _has_trip(self) -> bool:
        """Whether the person's start is that of a trip."""
        return "trips" in self.table and self.kind.place not in self.table

    def _plugins(self) -> tuple[str, ...]:
        """The behaviours of a user's own that may be drawn, whose keys are not known."""
        value = self.table.get("behaviour")
        names = [*value, *value.get("one_of", ())] if isinstance(value, Mapping) else [value]
        return tuple(name for name in names if isinstance(name, str) and ":" in name)


def _only_of_other_behaviours(own: set[str]) -> set[str]:
    every = {key for behaviour in BEHAVIOURS.values() for key in config.keys(behaviour)}
    return every - own
