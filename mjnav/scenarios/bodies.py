"""What stands still in a scene: walls, tables, pillars and lane boundaries."""

from dataclasses import dataclass
from math import hypot
from typing import Annotated

import numpy as np

from mjnav.config import Key, Range, settle
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios.ranges import MAX_LENGTH, MIN_SIZE, Angle, Line, Point, Size


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall between two points."""

    start: Annotated[Point, Key("from"), "one end"]
    end: Annotated[Point, Key("to"), "the other end"]
    thickness: Annotated[Size, "half of it on each side of the line"] = 0.1
    height: Annotated[Size, "above the floor"] = 1.0

    def __post_init__(self):
        settle(self)
        if hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]) < MIN_SIZE:
            raise InvalidValue("to", self.end, f"a point other than `from`, at least {MIN_SIZE:g} m away")


@dataclass(frozen=True, slots=True)
class Table:
    """A table on four legs; `size` is measured between the legs' centres."""

    position: Annotated[Point, "of its centre"]
    yaw: Annotated[Angle, "of its long side, counter-clockwise from x"] = 0.0
    size: Annotated[tuple[Size, Size], "between the centres of the legs"] = (1.6, 0.8)
    leg_radius: Annotated[Size, "of each leg"] = 0.03
    height: Annotated[float, Range(0.5, MAX_LENGTH, "m"), "of its top above the floor"] = 0.74

    def __post_init__(self):
        settle(self)
        for i, side in enumerate(self.size):
            Range(2.0 * self.leg_radius, MAX_LENGTH, "m", open_low=True).check(f"size.{i}", side)

    @property
    def legs(self) -> Array:
        """Centres of the four legs, (4, 2)."""
        corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * self.size
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.asarray(self.position) + corners @ np.array([[c, s], [-s, c]])


@dataclass(frozen=True, slots=True)
class Pillar:
    """A round pillar."""

    position: Annotated[Point, "of its centre"]
    radius: Annotated[Size, "of the pillar"] = 0.2
    height: Annotated[Size, "above the floor"] = 1.0

    def __post_init__(self):
        settle(self)


@dataclass(frozen=True, slots=True)
class LaneSpec:
    """Two lines a x + b y + c = 0; the left one keeps d <= 0, the right one d >= 0."""

    left: Annotated[Line, "a, b, c of the left boundary"]
    right: Annotated[Line, "a, b, c of the right boundary"]

    def __post_init__(self):
        settle(self)
        for key in ("left", "right"):
            line = getattr(self, key)
            if hypot(line[0], line[1]) < MIN_SIZE:
                raise InvalidValue(key, line, f"a line a x + b y + c = 0, (a, b) at least {MIN_SIZE:g} long")
