"""What stands still in a scene: walls, tables, pillars and lane boundaries."""

from dataclasses import dataclass
from math import hypot

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.scenarios.ranges import MAX_LENGTH, MIN_SIZE, Point, check_coordinates, check_range, check_size


@dataclass(frozen=True, slots=True)
class Wall:
    """A straight wall between two points."""

    start: Point
    end: Point
    thickness: float = 0.1
    height: float = 1.0

    def __post_init__(self):
        check_coordinates("from", self.start)
        check_coordinates("to", self.end)
        if hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]) < MIN_SIZE:
            raise InvalidValue("to", self.end, f"a point other than `from`, at least {MIN_SIZE:g} m away")
        check_size("thickness", self.thickness)
        check_size("height", self.height)


@dataclass(frozen=True, slots=True)
class Table:
    """A table on four legs; `size` is measured between the legs' centres."""

    position: Point
    yaw: float = 0.0
    size: Point = (1.6, 0.8)
    leg_radius: float = 0.03
    height: float = 0.74

    def __post_init__(self):
        check_coordinates("position", self.position)
        check_coordinates("yaw", (self.yaw,))
        check_size("leg_radius", self.leg_radius)
        for i, side in enumerate(self.size):
            check_range(f"size.{i}", side, 2.0 * self.leg_radius, MAX_LENGTH, open_low=True)
        check_range("height", self.height, 0.5, MAX_LENGTH)

    @property
    def legs(self) -> Array:
        """Centres of the four legs, (4, 2)."""
        corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * self.size
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.asarray(self.position) + corners @ np.array([[c, s], [-s, c]])


@dataclass(frozen=True, slots=True)
class Pillar:
    """A round pillar."""

    position: Point
    radius: float = 0.2
    height: float = 1.0

    def __post_init__(self):
        check_coordinates("position", self.position)
        check_size("radius", self.radius)
        check_size("height", self.height)


@dataclass(frozen=True, slots=True)
class LaneSpec:
    """Two lines a x + b y + c = 0; the left one keeps d <= 0, the right one d >= 0."""

    left: tuple[float, float, float]
    right: tuple[float, float, float]

    def __post_init__(self):
        for key in ("left", "right"):
            line = getattr(self, key)
            check_coordinates(key, line)
            if hypot(line[0], line[1]) < MIN_SIZE:
                raise InvalidValue(key, line, f"a line a x + b y + c = 0, (a, b) at least {MIN_SIZE:g} long")
