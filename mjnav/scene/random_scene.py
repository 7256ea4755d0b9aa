"""Random scenes: a run file that draws values, and the seed of a layout, give a scenario whose values are all plain.

A body that has no room is drawn again by itself; walls come first, then tables, pillars, the robot and people. A layout
as a whole is drawn again, from other streams, where the scene's checks refuse it, where the robot has no way to its
goal, and where no control avoids the people at the start.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from math import ceil, hypot
from typing import Any

import numpy as np

from mjnav import settings
from mjnav.errors import InvalidValue
from mjnav.geometry.floor import Floor
from mjnav.messages import Array
from mjnav.rng import stream
from mjnav.scene.bodies import Pillar, Table, Wall, top_box, wall_box
from mjnav.scene.check import check, check_memory, is_avoidable, robot_has_a_way
from mjnav.scene.drafts import KINDS, Entry, Values, entries_of, robot_of
from mjnav.scene.draws import Draft, Layout
from mjnav.scene.people import Person
from mjnav.scene.published import is_open, put_case
from mjnav.scene.ranges import Point, Seed
from mjnav.scene.spec import Robot, Scenario
from mjnav.scene.ways import floor_of_people

# ------------------------------------------------------------------------------ room for one more body


ROBOT_ROOM = 0.1  # [m] around the robot's disc at its start, at each point of its route and on its way
PERSON_ROOM = 0.1  # [m] around a person at their start
ROBOT_TO_PERSON = 0.5  # [m] from a person's surface to the robot's at the start, unless the draft says more
_SPACING = 0.1  # [m] between the points that stand for a rectangle


@dataclass(slots=True)
class Room:
    """What has its place; `gap` is the least distance of drawn furniture from all else [m]."""

    gap: float
    walls: list[Wall] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    pillars: list[Pillar] = field(default_factory=list)
    people: list[Person] = field(default_factory=list)
    robot: Robot | None = None  # None until its place is known

    def holds(self, body: Wall | Table | Pillar | Person | Robot, entry: Entry) -> bool:
        """Whether there is room for one more body, which an entry draws."""
        match body:
            case Robot():
                return self._for_robot(body)
            case Person():
                return self._for_person(body, entry.table.get("clear_of_robot"))
        floor = floor_of_people(() if isinstance(body, Wall) else self.walls, self.tables, self.pillars)
        if isinstance(body, Pillar):
            return self._for_furniture(np.array([body.position]), body.radius, floor)
        return self._for_furniture(_body_points(body), 0.0, floor)

    def _for_furniture(self, points: Array, radius: float, others: Floor) -> bool:
        """Whether discs at points (n, 2) keep the gap from the bodies of a floor, and clear of the robot.

        Furniture keeps clear of all that stands there, a wall of furniture: walls may cross.
        """
        if others.clearance(points).min() - radius < self.gap:
            return False
        if self.robot is None:
            return True
        places = np.array([self.robot.start[:2], *self.robot.route])
        distance = np.hypot(*np.moveaxis(points[:, None] - places, -1, 0))
        return bool(distance.min() >= radius + self.robot.radius + ROBOT_ROOM)

    def _for_robot(self, robot: Robot) -> bool:
        """Whether the robot's start and route keep clear of walls and furniture, its start of people."""
        points = [robot.start[:2], *robot.route]
        clearance = floor_of_people(self.walls, self.tables, self.pillars).clearance(points)
        people = all(_apart(robot.start, p.start) - p.radius - robot.radius >= ROBOT_TO_PERSON for p in self.people)
        return bool(clearance.min() >= robot.radius + ROBOT_ROOM) and people

    def _for_person(self, person: Person, clear_of_robot: float | None) -> bool:
        """Whether a person's start keeps clear of all, and their waypoints of walls, furniture and the robot's goals.

        `clear_of_robot` [m] is the least distance of the centres; by default the surfaces are ROBOT_TO_PERSON apart.
        """
        floor = floor_of_people(self.walls, self.tables, self.pillars)
        waypoints: Sequence[Point] = getattr(person.behaviour, "waypoints", ())
        if floor.clearance(np.array([person.start, *waypoints])).min() < person.radius + PERSON_ROOM:
            return False
        if any(_apart(person.start, o.start) < person.radius + o.radius + PERSON_ROOM for o in self.people):
            return False
        if self.robot is None:
            return True
        both = person.radius + self.robot.radius
        least = both + ROBOT_TO_PERSON if clear_of_robot is None else max(both, clear_of_robot)
        ends = (person.start, *waypoints[-1:])  # where a person may stand
        return _apart(person.start, self.robot.start) >= least and all(
            _apart(end, goal) >= both for end in ends for goal in self.robot.route
        )


def _body_points(body: Wall | Table) -> Array:
    """Points of a wall or a whole table as seen from above, (n, 2) [m]."""
    box = wall_box("", body) if isinstance(body, Wall) else top_box("", body)
    c, s = box.along
    u, v = (
        np.linspace(-0.5 * side, 0.5 * side, ceil(side / _SPACING) + 1) for side in (2.0 * half for half in box.half)
    )
    u, v = (grid.ravel() for grid in np.meshgrid(u, v))
    return np.stack([box.centre[0] + c * u - s * v, box.centre[1] + s * u + c * v], axis=1)


def _apart(one: Sequence[float], other: Sequence[float]) -> float:
    """Distance of two points in the plane [m]."""
    return hypot(one[0] - other[0], one[1] - other[1])


# ------------------------------------------------------------------------------------------ layouts


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
    with settings.below("seed"):
        seed = settings.settled(Seed, document.get("seed", 0))
    if is_open(document):
        scenario = settings.read_document(Scenario, put_case(document, seed))
        check_memory(scenario)
        check(scenario)
        return replace(scenario, draft=draft)
    with settings.below("layout"):
        layout = settings.settled(Layout, document.get("layout", {}))
    layout = layout if layout.seed is not None else replace(layout, seed=seed)
    entries, robot = tuple(entries_of(document)), robot_of(document)
    for entry in (*entries, robot):
        if entry.is_drawn:
            entry.check()
    reason, misses = None, 0
    for attempt in range(layout.tries):
        layout_drawing = _Drawing(document, entries, robot, layout, attempt)
        try:
            return replace(layout_drawing.scenario(), draft=draft)
        except _Refused as refused:
            reason = refused
        misses += layout_drawing.misses
        if misses >= MAX_MISSES:
            found = f"{attempt + 1} layouts without room"
            raise InvalidValue("layout", found, f"a scene that has room for all that it draws; {reason}")
    allowed = f"a scene of which one layout in so many can be used; of the last one, {reason}"
    raise InvalidValue("layout.tries", layout.tries, allowed)


class _Drawing:
    """One attempt at one layout."""

    def __init__(
        self, document: Mapping[str, Any], entries: Sequence[Entry], robot: Entry, layout: Layout, attempt: int
    ):
        """`entries` and `robot` are those of the document."""
        self._document, self._entries, self._robot = document, entries, robot
        self._layout, self._attempt = layout, attempt
        self._open: dict[str, np.random.Generator] = {}
        self.misses = 0  # places that had no room

    def scenario(self) -> Scenario:
        """The scenario. Raises _Refused where this attempt comes to nothing."""
        document, robot = self._document, self._robot
        tables: dict[str, Any] = {kind: [] for kind in KINDS}
        tables["robot"], body = next(robot.bodies("robot", self._stream))
        gap = self._layout.gap
        room = Room(2.0 * body.radius + _GAP if gap is None else gap, robot=None if robot.is_placed else body)
        for entry in self._entries:
            if not entry.is_drawn:
                with settings.below(*entry.key.split(".")):
                    getattr(room, entry.name).append(settings.read(entry.kind.plain, entry.table))
        for kind in ("walls", "tables", "pillars"):
            self._place(kind, tables, room)
        if robot.is_placed:
            tables["robot"], room.robot = self._first_with_room(robot, "robot", room)
        self._place("people", tables, room)
        tables["layout"] = settings.tables(self._layout)
        given = {key: value for key, value in tables.items() if value or key in document}
        scenario = settings.read_document(Scenario, {**document, **given})
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
        for entry in (one for one in self._entries if one.name == kind):
            if not entry.is_drawn:
                tables[kind].append(dict(entry.table))
                continue
            for number in range(entry.num(self._stream)):
                table, body = self._first_with_room(entry, f"{entry.key}.{number}", room)
                tables[kind].append(table)
                getattr(room, kind).append(body)

    def _first_with_room(self, entry: Entry, prefix: str, room: Room) -> tuple[Values, Any]:
        for table, body in islice(entry.bodies(prefix, self._stream), MAX_PLACES):
            if room.holds(body, entry):
                return table, body
            self.misses += 1
        raise _Refused(f"{entry.key}: none of {MAX_PLACES} places of {prefix} is clear of all that stands there")

    def _stream(self, key: str) -> np.random.Generator:
        """The stream of one value; in one attempt it goes on where it was."""
        if key not in self._open:
            again = f" of attempt {self._attempt}" if self._attempt else ""
            self._open[key] = stream(self._layout.root(), f"layout.{self._layout.purpose}", f"{key}{again}")
        return self._open[key]
