"""Random scenes resolved: a random scene and the seed of a layout give a scenario whose values are all plain.

Each value comes from a stream of its own, named after its place in the file ("people.2.0.speed" is the first person of
the third entry), so that another entry, or another key, moves no draw. A body that has no room is drawn again by
itself; walls come first, then tables, pillars, the robot and people. A layout as a whole is drawn again, from other
streams, where the scene's checks refuse it, where the robot has no way to its goal, and where no control avoids the
people at the start.

The second part adds random scenes to the JSON Schema and to the reference of keys.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mjnav import config
from mjnav.config import below
from mjnav.config.reference import INDEX, KeyReference, key_references
from mjnav.config.table import Schema, table_schema
from mjnav.errors import InvalidValue
from mjnav.rng import stream
from mjnav.scenarios.check import check, check_memory, robot_has_a_way
from mjnav.scenarios.layout.entries import KINDS, DrawnRobot, Entry
from mjnav.scenarios.layout.placing import ROBOT_ROOM, DrawnPlaces, Room, check_areas, entries_of, is_avoidable
from mjnav.scenarios.random_scene import Draft, Layout
from mjnav.scenarios.ranges import Seed
from mjnav.scenarios.spec import Person, Robot, Scenario, Wall

# ---------------------------------------------------------------------------------------- resolving


MAX_PLACES = 200  # in which a body is tried before the layout is drawn anew
MAX_MISSES = 20 * MAX_PLACES  # places without room, in all layouts, after which the scene is refused: about a second
_GAP = 0.4  # [m] beside the robot's diameter


class _Refused(Exception):
    """This layout cannot be used; the reason, below the draft's keys."""


def resolved(document: Mapping[str, Any], draft: Draft) -> Scenario:
    """The scenario of a random scene's tables, checked; `draft` is `draft_of` them.

    The seed of the layout is that of [layout], or else the run's. Raises InvalidValue, whose key is the draft's, also
    where none of `layout.tries` layouts can be used.
    """
    with below("seed"):
        seed = config.settled(Seed, document.get("seed", 0))
    with below("layout"):
        layout = config.settled(Layout, document.get("layout", {}))
    layout = layout if layout.seed is not None else replace(layout, seed=seed)
    for entry in entries_of(draft.tables):
        if entry.is_drawn:
            try:
                entry.check()
            except InvalidValue as error:
                raise error.within(entry.key) from None
    DrawnPlaces(document.get("robot", {})).check()
    check_areas(document)
    reason, misses = None, 0
    for attempt in range(layout.tries):
        drawing = _Drawing(document, layout, attempt)
        try:
            return replace(drawing.scenario(), draft=draft)
        except _Refused as refused:
            reason = refused
        misses += drawing.misses
        if misses >= MAX_MISSES:
            found = f"{attempt + 1} layouts without room"
            raise InvalidValue("layout", found, f"a scene that has room for all that it draws; {reason}")
    allowed = f"a scene of which one layout in so many can be used; of the last one, {reason}"
    raise InvalidValue("layout.tries", layout.tries, allowed)


class _Drawing:
    """One attempt at one layout."""

    def __init__(self, document: Mapping[str, Any], layout: Layout, attempt: int):
        self._document, self._layout, self._attempt = document, layout, attempt
        self._open: dict[str, np.random.Generator] = {}
        self.misses = 0  # places that had no room

    def scenario(self) -> Scenario:
        """The scenario. Raises _Refused where this attempt comes to nothing."""
        document, robot = self._document, DrawnPlaces(self._document.get("robot", {}))
        tables: dict[str, Any] = {kind: [] for kind in KINDS}
        with below("robot"):
            first = next(robot.tables(self._stream))
            body = config.read(Robot, first)
        gap = self._layout.gap
        room = Room(2.0 * body.radius + _GAP if gap is None else gap, robot=None if robot.is_placed else body)
        for entry in entries_of(document):
            if not entry.is_drawn:
                with below(entry.key.partition(".")[0]), below(entry.key.partition(".")[2]):
                    getattr(room, _kind(entry)).append(config.read(entry.kind.plain, entry.table))
        for kind in ("walls", "tables", "pillars"):
            self._place(kind, tables, room)
        tables["robot"] = self._place_robot(robot, room) if robot.is_placed else first
        self._place("people", tables, room)
        tables["layout"] = config.tables(self._layout)
        given = {key: value for key, value in tables.items() if value or key in document}
        scenario = config.read_document(Scenario, {**document, **given})
        check_memory(scenario)
        if not robot_has_a_way(scenario, ROBOT_ROOM):
            raise _Refused("the robot has no way to its goal")
        try:
            check(scenario)
        except InvalidValue as error:
            raise _Refused(f"{error.key}: found {error.found!r}; allowed: {error.allowed}") from None
        if not is_avoidable(scenario):
            raise _Refused("no control of the robot avoids the people of the first seconds")
        return scenario

    def _place(self, kind: str, tables: dict[str, Any], room: Room) -> None:
        """Puts the bodies of one kind into the room and, as plain entries in the order of the file, into `tables`."""
        for entry in entries_of({kind: self._document.get(kind)}):
            if not entry.is_drawn:
                tables[kind].append(dict(entry.table))
                continue
            for number in range(entry.num(self._stream)):
                table, body = self._first_with_room(entry, number, room)
                tables[kind].append(table)
                getattr(room, kind).append(body)

    def _first_with_room(self, entry: Entry, number: int, room: Room) -> tuple[dict[str, Any], Any]:
        places = entry.bodies(number, self._stream)
        for _ in range(MAX_PLACES):
            try:
                table = next(places)
                body = config.read(entry.kind.plain, table)
            except InvalidValue as error:
                raise error.within(entry.key) from None
            if _has_room(room, body, entry.table.get("clear_of_robot")):
                return table, body
            self.misses += 1
        raise _Refused(
            f"{entry.key}: none of {MAX_PLACES} places for number {number} is clear of all that stands there"
        )

    def _place_robot(self, robot: DrawnPlaces, room: Room) -> dict[str, Any]:
        places = robot.tables(self._stream)
        for _ in range(MAX_PLACES):
            with below("robot"):
                table = next(places)
                body = config.read(Robot, table)
            if robot.is_long(body) and room.for_robot(body):
                room.robot = body
                return table
            self.misses += 1
        raise _Refused(f"robot: none of {MAX_PLACES} starts and goals is clear of all else, and far apart")

    def _stream(self, key: str) -> np.random.Generator:
        """The stream of one value; in one attempt it goes on where it was."""
        if key not in self._open:
            again = f" of attempt {self._attempt}" if self._attempt else ""
            self._open[key] = stream(self._layout.root(), f"layout.{self._layout.purpose}", f"{key}{again}")
        return self._open[key]


def _kind(entry: Entry) -> str:
    return entry.key.partition(".")[0]


def _has_room(room: Room, body: Any, clear_of_robot: float | None) -> bool:
    match body:
        case Wall():
            return room.for_wall(body)
        case Person():
            return room.for_person(body, clear_of_robot)
    return room.for_furniture(body)


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
    schema["properties"]["robot"] = {"anyOf": [schema["properties"]["robot"], robot]}
    return schema


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
