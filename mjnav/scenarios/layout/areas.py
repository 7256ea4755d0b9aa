"""Areas of a random scene in which its fixed walls and furniture leave no place: told before anything is drawn."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from mjnav import config
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios.floor import floor_of_people, floor_of_robot
from mjnav.scenarios.layout.draft import entries_of
from mjnav.scenarios.spec import Person, Robot

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
            if floor_of_people(*bodies).clearance(_points(area)).max() <= radius:
                raise _no_room(f"{entry.key}.{key}", area, "a person", radius)
    robot = document.get("robot", {})
    for key in ("start_area", "goal_area"):
        radius = _radius(robot, Robot)
        if key in robot and floor_of_robot(*bodies).clearance(_points(robot[key])).max() <= radius:
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


def _points(area: Any) -> Array:
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
