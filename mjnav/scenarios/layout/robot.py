"""The robot's start and goal in a random scene."""

from collections.abc import Iterator, Mapping
from math import atan2, hypot
from typing import Any

from mjnav import config
from mjnav.config import below
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.layout.draws import Streams, draw_point
from mjnav.scenarios.layout.entries import DrawnRobot
from mjnav.scenarios.layout.values import ANY, check_value, draw_value, is_drawn
from mjnav.scenarios.spec import Robot

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
