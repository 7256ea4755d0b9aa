"""Placing of bodies and the robot in a random scene: room for each, and starts from which contact can be avoided.

Areas in which the fixed walls and furniture leave no place are refused before anything is drawn. `Room` tells whether
one more body has room beside those that stand in the scene already.

`foreseen` tells where people will be in the next seconds if nobody and nothing is in their way.

The oracle (`is_avoidable`) tells whether any control of the robot avoids all contact in the first seconds of a scene.
People who start close ahead of a fast robot, or walk at one that stands, cannot be avoided by anybody: such a start
tests no method. The oracle knows all. It rolls out a robot that is at rest at the start, as in every run, under
controls that hold one speed and turn rate, then another, within the robot's limits of speed and acceleration; people
walk on as they would unseen (`foreseen`); walls, pillars and tables' legs stand. A start is avoidable where one of the
controls touches nothing.

The last two parts draw the robot's start and goal, and tell which tables of a run file draw something.
"""

from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, product
from math import atan2, ceil, cos, hypot, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav import config
from mjnav.config import below
from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import Array
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.layout.entries import KINDS, DrawnRobot, Entry
from mjnav.scenarios.layout.values import ANY, Streams, check_value, draw_point, draw_value, is_drawn
from mjnav.scenarios.people import ConstantVelocity, Person, Replay, Row, StopAndGo, Walker
from mjnav.scenarios.random_scene import Draft
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Robot, Scenario
from mjnav.scenarios.ways import floor_of_people, floor_of_robot

# ------------------------------------------------------------------------------- areas without room


_POINTS = 33  # along each side of a rectangle, at which room is looked for


def check_areas(document: Mapping[str, Any]) -> None:
    """Raises InvalidValue for the first area in which no person, or not the robot, has room beside what is not drawn.

    The tables are checked but for this. Of a radius that is drawn the least counts, or 0.
    """
    fixed: dict[str, list[Any]] = {"walls": [], "tables": [], "pillars": []}
    people = []
    for entry in entries_of(document):
        kind = entry.key.partition(".")[0]
        if kind == "people" and entry.is_drawn:
            people.append(entry)
        elif kind in fixed and not entry.is_drawn:
            try:
                fixed[kind].append(config.read(entry.kind.plain, entry.table))
            except InvalidValue as error:
                raise error.within(entry.key) from None
    bodies = fixed["walls"], fixed["tables"], fixed["pillars"]
    for entry in people:
        radius = _radius(entry.table, Person)
        for key, area in _areas(entry.table):
            if floor_of_people(*bodies).clearance(_area_points(area)).max() <= radius:
                raise _no_room(f"{entry.key}.{key}", area, "a person", radius)
    robot = document.get("robot", {})
    for key in ("start_area", "goal_area"):
        radius = _radius(robot, Robot)
        if key in robot and floor_of_robot(*bodies).clearance(_area_points(robot[key])).max() <= radius:
            raise _no_room(f"robot.{key}", robot[key], "the robot", radius)


def _areas(table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The areas in which a person's start and waypoints lie, and where trips begin and end, with their keys."""
    if "area" in table:
        yield "area", table["area"]
    waypoints = table.get("waypoints")
    if isinstance(waypoints, Mapping) and "area" in waypoints:
        yield "waypoints.area", waypoints["area"]
    for i, trip in enumerate(table.get("trips", ())):
        for end in ("from", "to"):
            yield f"trips.{i}.{end}", trip[end]


def _area_points(area: Any) -> Array:
    """Points all over an area, (n, 2) [m]."""
    rectangles = np.array(area, float).reshape(-1, 2, 2)
    shares = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, _POINTS)] * 2), axis=-1).reshape(-1, 2)
    return np.concatenate([first + shares * (last - first) for first, last in rectangles])


def _radius(table: Mapping[str, Any], body: type) -> float:
    value = table.get("radius", config.keys(body)["radius"].default)
    value = value.get("low") if isinstance(value, Mapping) else value
    return float(value) if isinstance(value, int | float) else 0.0


def _no_room(key: str, area: Any, who: str, radius: float) -> InvalidValue:
    return InvalidValue(key, area, f"an area with room for {who}, {radius:g} m clear of walls and furniture")


# --------------------------------------------------------------------------- room for one more body


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

    def for_wall(self, wall: Wall) -> bool:
        """Whether a wall keeps clear of furniture and of the robot; walls may cross."""
        points = _body_points(wall)
        furniture = floor_of_people((), self.tables, self.pillars).clearance(points)
        return bool(furniture.min() >= self.gap) and self._clear_of_robot(points, 0.0)

    def for_furniture(self, body: Table | Pillar) -> bool:
        """Whether a table or a pillar keeps the gap from all that stands there, and clear of the robot."""
        points, radius = (
            (np.array([body.position]), body.radius) if isinstance(body, Pillar) else (_body_points(body), 0.0)
        )
        least = floor_of_people(self.walls, self.tables, self.pillars).clearance(points).min() - radius
        return bool(least >= self.gap) and self._clear_of_robot(points, radius)

    def for_robot(self, robot: Robot) -> bool:
        """Whether the robot's start and route keep clear of walls and furniture, and its start of people."""
        points = [robot.start[:2], *robot.route]
        clearance = floor_of_people(self.walls, self.tables, self.pillars).clearance(points)
        people = all(_apart(robot.start, p.start) - p.radius - robot.radius >= ROBOT_TO_PERSON for p in self.people)
        return bool(clearance.min() >= robot.radius + ROBOT_ROOM) and people

    def for_person(self, person: Person, clear_of_robot: float | None) -> bool:
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

    def _clear_of_robot(self, points: Array, radius: float) -> bool:
        if self.robot is None:
            return True
        places = np.array([self.robot.start[:2], *self.robot.route])
        distance = np.hypot(*np.moveaxis(points[:, None] - places, -1, 0))
        return bool(distance.min() >= radius + self.robot.radius + ROBOT_ROOM)


def _body_points(body: Wall | Table) -> Array:
    """Points of a wall or a whole table as seen from above, (n, 2) [m]."""
    if isinstance(body, Wall):
        (x0, y0), (x1, y1) = body.start, body.end
        centre, along, across = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), hypot(x1 - x0, y1 - y0), body.thickness
        c, s = (x1 - x0) / along, (y1 - y0) / along
    else:
        centre, (along, across) = body.position, (side + 2.0 * body.leg_radius for side in body.size)
        c, s = cos(body.yaw), sin(body.yaw)
    u, v = (np.linspace(-0.5 * side, 0.5 * side, ceil(side / _SPACING) + 1) for side in (along, across))
    u, v = (grid.ravel() for grid in np.meshgrid(u, v))
    return np.stack([centre[0] + c * u - s * v, centre[1] + s * u + c * v], axis=1)


def _apart(one: Sequence[float], other: Sequence[float]) -> float:
    """Distance of two points in the plane [m]."""
    return hypot(one[0] - other[0], one[1] - other[1])


# --------------------------------------------------------------------------- people's ways foreseen


MAX_ROUNDS = 100  # of a loop that are foreseen


def foreseen(person: Person, times: Array) -> Array:
    """Where the person is at each of `times` [s], ascending: (T, 2) [m]; NaN while they are not there.

    Straight walkers go at their velocity, walkers along straight legs, recorded people straight from row to row of
    their track; people of behaviours of one's own stand. Who leaves at the end of a way is gone: where they come again
    is not foreseen.
    """
    enters = person.enters or 0.0
    there = (times >= enters) & (times < (np.inf if person.leaves is None else person.leaves))
    since = np.maximum(times - enters, 0.0)
    match person.behaviour:
        case Replay(track=track):
            where = _on_track(track, times)
        case ConstantVelocity(velocity=velocity):
            where = person.start + since[:, None] * velocity
        case StopAndGo(velocity=velocity, go_time=go, stop_time=stop):
            walked = _walking(np.maximum(times, enters), go, stop) - _walking(np.array([enters]), go, stop)
            where = person.start + walked[:, None] * velocity
        case Walker() as walk:
            where, left = _on_legs(person.start, walk, walk.speed * since)
            within = walk.leaves_within
            there &= np.full(len(times), True) if within is None else left > within
        case _:
            where = np.tile(person.start, (len(times), 1))
    return np.where(there[:, None], where, np.nan)


def _on_track(track: tuple[Row, ...], times: Array) -> Array:
    """(T, 2) [m] at `times` (T,) [s]."""
    rows = np.array(track[: bisect_left(track, times[-1], key=lambda row: row[0]) + 1])
    return np.stack([np.interp(times, rows[:, 0], rows[:, k]) for k in (1, 2)], axis=1)


def _walking(times: Array, go: float, stop: float) -> Array:
    """For how long of [0, time] who walks and stands in turns has walked, (T,) [s]."""
    rounds, rest = np.divmod(times, go + stop)
    return go * rounds + np.minimum(rest, go)


def _on_legs(start: Point, walk: Walker, walked: Array) -> tuple[Array, Array]:
    """After `walked` [m] (T,): where a walker is, (T, 2), and how far it still is to the last point, (T,) [m]."""
    points = [start, *walk.waypoints]
    if walk.loop and len(walk.waypoints) > 1:
        around = sum(np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise([*walk.waypoints, walk.waypoints[0]]))
        rounds = int(walked[-1] / around) + 1 if around > 0.0 else 0
        points += walk.waypoints * min(rounds, MAX_ROUNDS)
    corners = np.array(points, float)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])  # [m] of each corner
    where = np.stack([np.interp(walked, along, corners[:, k]) for k in (0, 1)], axis=1)
    return where, along[-1] - walked


# --------------------------------------------------------------------------------------- the oracle


HORIZON = 3.0  # [s]
STEP = 0.05  # [s]; a person at 1.3 m/s moves 65 mm
SWITCH = 1.0  # [s] after which a control goes on to its second speed and turn rate
SPEEDS = (0.0, 0.5, 1.0)  # shares of the highest speed; of the lowest too where the robot may reverse
TURNS = (-1.0, -0.4, 0.0, 0.4, 1.0)  # shares of the highest turn rate


def is_avoidable(scenario: Scenario) -> bool:
    """Whether one of the sampled controls touches nothing within HORIZON."""
    robot, times = scenario.robot, STEP * np.arange(1, round(HORIZON / STEP) + 1, dtype=float)
    fastest = max(robot.max_speed, -robot.min_speed)
    near: list[tuple[Person, Array]] = []  # who can meet the robot, and where they are at `times`, (T, 2)
    standing = True  # whether a robot that stands touches nobody
    for person in scenario.people:
        walked = foreseen(person, times)
        gaps = np.hypot(walked[:, 0] - robot.start[0], walked[:, 1] - robot.start[1]) - person.radius - robot.radius
        if (gaps <= fastest * times).any():  # NaN for who is not there
            near.append((person, walked))
            standing &= not _touches(gaps[None], person).any()
    if standing:
        return True
    clear = _rollouts(robot, len(times))  # (K, T, 2) of which those stay that touch nothing
    for person, walked in near:
        gaps = np.hypot(*np.moveaxis(clear - walked, -1, 0)) - person.radius - robot.radius
        clear = clear[~_touches(gaps, person).any(axis=1)]
    floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
    return bool((floor.clearance(clear) >= robot.radius).all(axis=1).any()) if len(clear) else False


def _touches(gaps: Array, person: Person) -> NDArray[np.bool_]:
    """(K, T) where surfaces (K, T) [m] apart touch. A newcomer waits until the robot has left the place."""
    if person.from_the_start:
        return gaps < 0.0
    return (gaps < 0.0) & np.logical_or.accumulate(gaps >= 0.0, axis=1)


def _rollouts(robot: Robot, num: int) -> Array:
    """Positions of the robot under every control after each of `num` steps, (K, num, 2) [m]."""
    speeds = sorted({share * robot.max_speed for share in SPEEDS} | {robot.min_speed})
    turns = [share * robot.max_turn_rate for share in TURNS]
    wanted = np.array([(*one, *other) for one, other in product(product(speeds, turns), repeat=2)])  # (K, 4)
    x, y, heading = (np.full(len(wanted), value) for value in robot.start)
    v, omega = np.zeros(len(wanted)), np.zeros(len(wanted))
    out = np.empty((len(wanted), num, 2))
    for k in range(num):
        target = wanted[:, :2] if k * STEP < SWITCH else wanted[:, 2:]
        v = v + np.clip(target[:, 0] - v, -robot.max_acceleration * STEP, robot.max_acceleration * STEP)
        omega = omega + np.clip(
            target[:, 1] - omega, -robot.max_turn_acceleration * STEP, robot.max_turn_acceleration * STEP
        )
        heading = heading + omega * STEP
        x, y = x + v * np.cos(heading) * STEP, y + v * np.sin(heading) * STEP
        out[:, k, 0], out[:, k, 1] = x, y
    return out


# ----------------------------------------------------------------------- the robot's start and goal


_PLACES = ("start", "start_heading", "goal", "waypoints")  # keys that are drawn again where the robot has no room


class DrawnPlaces:
    """The table of the robot in a draft."""

    def __init__(self, table: Mapping[str, Any]):
        self._table = table
        self._plain = {key: field.hint for key, field in config.keys(Robot).items()}
        self._drawn = {key: field.hint for key, field in config.keys(DrawnRobot).items()}

    @property
    def is_drawn(self) -> bool:
        """Whether anything in it is drawn."""
        return any(
            key in self._drawn or (key in self._plain and is_drawn(self._plain[key], value))
            for key, value in self._table.items()
        )

    @property
    def is_placed(self) -> bool:
        """Whether its start, waypoints or goal are drawn."""
        return any(
            key in self._drawn or (key in _PLACES and is_drawn(self._plain[key], value))
            for key, value in self._table.items()
        )

    def check(self) -> None:
        """Raises InvalidValue, below "robot", for what may not be drawn; other keys are left to the reader."""
        with below("robot"):
            for key, value in self._table.items():
                if key not in {**self._plain, **self._drawn}:
                    raise unknown_name(key, key, {**self._plain, **self._drawn})
                if key in self._drawn or is_drawn(self._plain.get(key, ANY), value):
                    with below(key):
                        check_value({**self._plain, **self._drawn}.get(key, ANY), value)
            for area, key in (("start_area", "start"), ("goal_area", "goal"), ("goal_area", "waypoints")):
                if area in self._table and key in self._table:
                    raise InvalidValue(area, self._table[area], f"{area} or {key}, not both")

    def tables(self, streams: Streams) -> Iterator[dict[str, Any]]:
        """Plain tables of the robot, each time in other places, without end."""
        fixed = {key: self._value(key, streams) for key in self._table if key not in (*_PLACES, *self._drawn)}
        while True:
            values = {**fixed, **{key: self._value(key, streams) for key in _PLACES if key in self._table}}
            if "goal_area" in self._table:
                values["goal"] = draw_point(self._table["goal_area"], streams("robot.goal_area"))
            heading = values.pop("start_heading", None)
            if "start_area" in self._table:
                x, y = draw_point(self._table["start_area"], streams("robot.start_area"))
                goal = (values.get("goal") or values.get("waypoints", [[x + 1.0, y]])[0])[:2]
                values["start"] = [x, y, atan2(goal[1] - y, goal[0] - x) if heading is None else heading]
            yield values

    def _value(self, key: str, streams: Streams) -> Any:
        return draw_value({**self._plain, **self._drawn}.get(key, ANY), self._table[key], f"robot.{key}", streams)

    def is_long(self, robot: Robot) -> bool:
        """Whether the goal is `least_way` from the start."""
        (x, y), goal = robot.start[:2], robot.route[-1]
        return hypot(goal[0] - x, goal[1] - y) >= self._table.get("least_way", 0.0)


# --------------------------------------------------------------------------------- tables that draw


def draft_of(document: Mapping[str, Any]) -> Draft | None:
    """The tables of a run file that draw something; None where none does."""
    entries = [entry for entry in entries_of(document) if entry.is_drawn]
    drawn = {entry.key.partition(".")[0] for entry in entries}
    robot = document.get("robot")
    if isinstance(robot, Mapping) and DrawnPlaces(robot).is_drawn:
        drawn.add("robot")
    if not drawn:
        return None
    return Draft({key: value for key, value in document.items() if key in drawn or key == "layout"})


def entries_of(document: Mapping[str, Any]) -> Iterator[Entry]:
    """The entries of all arrays; what is no table in an array is left to the reader."""
    for name, kind in KINDS.items():
        items = document.get(name)
        for i, item in enumerate(items if isinstance(items, list) else ()):
            if isinstance(item, Mapping):
                yield Entry(kind, f"{name}.{i}", item)
