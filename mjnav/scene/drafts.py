"""Drafts: entries of a run file that draw values, the keys that only they have, and plain tables drawn from them.

The entries of people, tables, pillars and walls, and the robot, may draw values. Each value comes from a stream of its
own, named after its place in the file ("people.2.0.speed" is the first person of the third entry), so that another
entry, or another key, moves no draw.

The last part adds drafts to the JSON Schema and to the reference of keys.
"""

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from math import atan2, cos, pi, sin
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from mjnav import settings
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scene.bodies import Pillar, Table, Wall
from mjnav.scene.draws import Area, Draft, Draw, Streams, draw_count, draw_point, drawing, is_draw
from mjnav.scene.library import data_folder
from mjnav.scene.people import AGAIN, BEHAVIOURS, MAX_WALKING_SPEED, ConstantVelocity, Person, StopAndGo, Trip
from mjnav.scene.published import is_open
from mjnav.scene.ranges import MAX_BODIES, MAX_LENGTH, Angle, Size
from mjnav.scene.spec import Robot
from mjnav.settings import Choice, Length, Range, Settled, below
from mjnav.settings.reference import INDEX, KeyReference, key_references
from mjnav.settings.table import Schema, table_schema

# ---------------------------------------------------------------------------- keys of random scenes


_Number = Annotated[int, Range(0, MAX_BODIES)]
Count = Annotated[
    Annotated[tuple[_Number, _Number], "least, largest"] | _Number,
    "how many are drawn, or the least and the largest number of them",
]


@dataclass(frozen=True, slots=True)
class Drawn(Settled):
    """An entry that stands for several bodies."""

    count: Count

    def _check(self):
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
class DrawnPeople(Drawn):
    """People; `velocity` may be given by a speed and a heading."""

    area: Annotated[Area | None, "in which `start` is drawn"] = None
    trips: Annotated[
        Annotated[tuple[Trip, ...], Length(1, MAX_BODIES)] | None,
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
class DrawnRobot(Settled):
    """The robot's start and goal."""

    start_area: Annotated[
        Area | None, "in which `start` is drawn, its heading towards the first point of the route"
    ] = None
    goal_area: Annotated[Area | None, "in which `goal` is drawn"] = None


# --------------------------------------------------------------------- drawn values as plain tables


Values = dict[str, Any]


def _put_point(values: Values, key: str, area: str, streams: Streams) -> None:
    """Puts a point of an area, where there is one, in its place under `key`."""
    if area in values:
        values[key] = draw_point(values.pop(area), streams(area))


def _furniture(values: Values, streams: Streams) -> Values:
    _put_point(values, "position", "area", streams)
    return values


def _wall(values: Values, streams: Streams) -> Values:
    _put_point(values, "from", "area", streams)
    if "from" in values and "length" in values:
        length, yaw = values.pop("length"), values.pop("yaw", 0.0)
        values["to"] = [values["from"][0] + length * cos(yaw), values["from"][1] + length * sin(yaw)]
    return values


def _person(values: Values, streams: Streams) -> Values:
    comes_again = values.get("at_end") == AGAIN  # who comes again draws further trips, in the run
    if not comes_again:
        values.pop("clear_of_robot", None)
    if "trips" in values and "start" not in values:
        trips = values["trips"] if comes_again else values.pop("trips")
        trip = trips[int(streams("trips").integers(len(trips)))]
        values["start"] = draw_point(trip["from"], streams("trips.from"))
        values.setdefault("waypoints", [draw_point(trip["to"], streams("trips.to"))])
    _put_point(values, "start", "area", streams)
    heading = values.pop("heading", None)
    if BEHAVIOURS.get(str(values.get("behaviour"))) in (ConstantVelocity, StopAndGo):
        speed = values.pop("speed", None)  # with a heading it stands for a velocity
        if "velocity" not in values and speed is not None:
            heading = float(streams("heading").uniform(-pi, pi)) if heading is None else heading
            values["velocity"] = [speed * cos(heading), speed * sin(heading)]
    return values


def _robot(values: Values, streams: Streams) -> Values:
    _put_point(values, "goal", "goal_area", streams)
    if "start_area" in values:
        x, y = draw_point(values.pop("start_area"), streams("start_area"))
        goal = (values.get("goal") or values.get("waypoints", [[x + 1.0, y]])[0])[:2]
        values["start"] = [x, y, atan2(goal[1] - y, goal[0] - x)]
    return values


# ------------------------------------------------------------------------------------------ entries


@dataclass(frozen=True, slots=True)
class Kind:
    """The entries of one array of a run file, or the robot."""

    plain: type  # what an entry becomes
    drawn: type  # the keys that only a draft has
    redrawn: tuple[str, ...]  # keys that are drawn again where a body has no room
    exclusive: tuple[tuple[str, str], ...]  # keys of which an entry has one
    as_plain: Callable[[Values, Streams], Values]  # the plain table of drawn values


_AT = (("area", "position"),)
KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "walls": Kind(
            Wall, DrawnWalls, ("area", "from", "to", "length", "yaw"), (("area", "from"), ("length", "to")), _wall
        ),
        "tables": Kind(Table, DrawnFurniture, ("area", "position", "yaw"), _AT, _furniture),
        "pillars": Kind(Pillar, DrawnFurniture, ("area", "position"), _AT, _furniture),
        "people": Kind(
            Person,
            DrawnPeople,
            ("area", "start", "trips", "waypoints"),
            (("area", "start"), ("area", "trips")),
            _person,
        ),
    }
)
ROBOT = Kind(
    Robot,
    DrawnRobot,
    ("start", "goal", "waypoints"),
    (("start_area", "start"), ("goal_area", "goal"), ("goal_area", "waypoints")),
    _robot,
)


@dataclass(frozen=True)
class Entry:
    """A table of a run file under its key, "people.2" or "robot"."""

    kind: Kind
    key: str
    table: Mapping[str, Any]

    @property
    def name(self) -> str:
        """Of the array, "people"."""
        return self.key.partition(".")[0]

    @property
    def is_drawn(self) -> bool:
        """Whether it draws something. Raises InvalidValue for a body that draws and does not say how many there are."""
        draws = self._draws(self.table)
        if self.kind is ROBOT:
            return draws or self._has_drafts_keys
        if draws and "count" not in self.table:
            raise InvalidValue(f"{self.key}.count", None, "count = 1 or more, in an entry that draws values")
        return "count" in self.table

    @property
    def is_placed(self) -> bool:
        """Whether its place is drawn."""
        return self._has_drafts_keys or self._draws(self.kind.redrawn)

    @property
    def _has_drafts_keys(self) -> bool:
        return not settings.keys(self.kind.drawn).keys().isdisjoint(self.table)

    def _draws(self, keys: Iterable[str]) -> bool:
        """Whether one of these keys draws its value."""
        hints = self._plain_hints()
        return any(is_draw(self.table[key], hints[key]) for key in keys if key in self.table and key in hints)

    def check(self) -> None:
        """Raises InvalidValue for a key that is not known and for what may not be drawn."""
        hints = self._hints()
        with below(*self.key.split(".")):
            for key in self.table:
                if key not in hints and not self._plugins():
                    raise unknown_name(key, key, hints)
            _ = self._drawings
            if "count" in self.table:
                settings.read(self.kind.drawn, {"count": self.table["count"]})
            for key, other in self.kind.exclusive:
                if key in self.table and other in self.table:
                    raise InvalidValue(key, self.table[key], f"{key} or {other}, not both")

    @cached_property
    def _drawings(self) -> dict[str, Draw]:
        """What draws the value of each key. Raises InvalidValue for what may not be drawn."""
        hints, drawings = self._hints(), {}
        for key, value in self.table.items():
            with below(key):
                drawings[key] = drawing(hints.get(key, Any), value)
        return drawings

    def num(self, streams: Streams) -> int:
        """How many bodies the entry stands for in this layout."""
        count = self.table["count"]
        return draw_count(tuple(count) if isinstance(count, list) else count, streams(f"{self.key}.count"))

    def bodies(self, prefix: str, streams: Streams) -> Iterator[tuple[Values, Any]]:
        """A body as a plain table and as read from it, each time in another place, without end.

        `prefix` is the key of the body's streams. Raises InvalidValue.
        """

        def of_body(part: str) -> np.random.Generator:
            return streams(f"{prefix}.{part}")

        foreign = set[str]()
        with below(*self.key.split(".")):
            draws = {key: draw for key, draw in self._drawings.items() if key != "count"}
            fixed = {key: draw(key, of_body) for key, draw in draws.items() if key not in self.kind.redrawn}
            if isinstance(self.table.get("behaviour"), Mapping):  # drop the keys that only other behaviours have
                chosen = BEHAVIOURS.get(str(fixed["behaviour"]))
                foreign = _behaviours_keys() - (set() if chosen is None else settings.keys(chosen).keys())
            while True:
                placed = {key: draws[key](key, of_body) for key in self.kind.redrawn if key in draws}
                table = self.kind.as_plain({**fixed, **placed}, of_body)
                table = {key: value for key, value in table.items() if key not in foreign}
                yield table, settings.read(self.kind.plain, table)

    def _plain_hints(self) -> dict[str, Any]:
        """The types of the keys that a plain entry may have; of a person those of every behaviour, too."""
        found = {key: field.hint for key, field in settings.keys(self.kind.plain).items() if not field.beside}
        if self.kind.plain is Person:
            for behaviour in BEHAVIOURS.values():
                found |= {key: field.hint for key, field in settings.keys(behaviour).items()}
            found["behaviour"] = Annotated[str, Choice((*BEHAVIOURS, *self._plugins()))]
        return found

    def _hints(self) -> dict[str, Any]:
        drawn = {key: field.hint for key, field in settings.keys(self.kind.drawn).items()}
        return {**drawn, **self._plain_hints()}

    def _plugins(self) -> tuple[str, ...]:
        """The behaviours of a user's own that may be drawn, whose keys are not known."""
        value = self.table.get("behaviour")
        names = [*value, *value.get("one_of", ())] if isinstance(value, Mapping) else [value]
        return tuple(name for name in names if isinstance(name, str) and ":" in name)


def _behaviours_keys() -> set[str]:
    return {key for behaviour in BEHAVIOURS.values() for key in settings.keys(behaviour)}


def entries_of(document: Mapping[str, Any]) -> Iterator[Entry]:
    """The entries of all arrays; what is no table in an array is left to the reader."""
    for name, kind in KINDS.items():
        items = document.get(name)
        for i, item in enumerate(items if isinstance(items, list) else ()):
            if isinstance(item, Mapping):
                yield Entry(kind, f"{name}.{i}", item)


def robot_of(document: Mapping[str, Any]) -> Entry:
    """The table of the robot."""
    table = document.get("robot")
    return Entry(ROBOT, "robot", table if isinstance(table, Mapping) else {})


def draft_of(document: Mapping[str, Any]) -> Draft | None:
    """The tables of a run file that draw something; None where none does."""
    if is_open(document):
        return Draft({"people": [], **{key: document[key] for key in ("published", "robot") if key in document}})
    drawn = {entry.name for entry in (*entries_of(document), robot_of(document)) if entry.is_drawn}
    if not drawn:
        return None
    return Draft({key: value for key, value in document.items() if key in drawn or key == "layout"})


def is_random(name: str) -> bool:
    """Whether a shipped scene is drawn anew for every seed; see `mjnav.scene.random_scene`."""
    text = (data_folder("runs") / f"{name}.toml").read_text(encoding="utf-8")
    return draft_of(tomllib.loads(text)) is not None


# ---------------------------------------------------------------- JSON Schema and reference of keys


WHERE = "random scenes"
_DRAW = {"anyOf": [{"type": "object"}, {"type": "array", "contains": {"type": "object"}}]}
_SOME_DRAW = {"not": {"additionalProperties": {"not": _DRAW}}}


def with_draws(schema: Schema) -> Schema:
    """The schema of a run file whose robot and arrays of bodies may be drafts, too.

    A draft may have a draw in place of any value, so that its schema names its own keys alone.
    """
    for name, kind in KINDS.items():
        items = schema["properties"][name]["items"]
        schema["properties"][name]["items"] = {"anyOf": [items, _draft(kind.drawn, schema)]}
    is_draft = [{"required": ["start_area"]}, {"required": ["goal_area"]}, _SOME_DRAW]
    robot = {**_draft(DrawnRobot, schema), "anyOf": is_draft}
    # With [published] no start is given.
    unplaced = {**schema["$defs"]["Robot"], "required": [], "not": {"required": ["start"]}}
    schema["properties"]["robot"] = {"anyOf": [schema["properties"]["robot"], robot, unplaced]}
    placed = {"properties": {"robot": {"anyOf": [{"required": ["start"]}, robot]}}}
    return {**schema, "if": {"not": {"required": ["published"]}}, "then": placed}


def _draft(drawn: type, schema: Schema) -> Schema:
    table = table_schema(drawn, schema["$defs"])
    properties = {key: {"anyOf": [value, _DRAW]} for key, value in table["properties"].items()}
    return {**table, "properties": properties, "additionalProperties": True}


def draft_keys(rows: list[KeyReference]) -> Iterator[KeyReference]:
    """The rows of a run file's keys, with those of random scenes behind the others of their table."""
    own = {f"{name}.{INDEX}.": kind.drawn for name, kind in KINDS.items()} | {"robot.": DrawnRobot}
    for i, row in enumerate(rows):
        yield row
        following = rows[i + 1].key if i + 1 < len(rows) else ""
        for prefix, kind in own.items():
            if row.key.startswith(prefix) and not following.startswith(prefix):
                yield from (replace(one, where=WHERE) for one in key_references(kind, prefix))
