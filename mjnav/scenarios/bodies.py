"""Bodies that stand still in a scene (walls, tables, pillars, lane boundaries), and their shapes seen from above.

Each shape has the key of its body in the run file.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, sin
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


# --------------------------------------------------------------------------- shapes seen from above


TOUCH = 1e-9  # [m]; bodies nearer than this touch


@dataclass(frozen=True, slots=True)
class Disc:
    """A round body."""

    key: str
    centre: Point
    radius: float
    height: float = 2.0

    def distance(self, point: Point) -> float:
        """From the surface to a point [m], negative inside."""
        return hypot(point[0] - self.centre[0], point[1] - self.centre[1]) - self.radius


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangular body."""

    key: str
    centre: Point
    yaw: float
    half: Point  # half the sides
    height: float

    def distance(self, point: Point) -> float:
        """From the surface to a point [m], negative inside."""
        c, s = cos(self.yaw), sin(self.yaw)
        x, y = point[0] - self.centre[0], point[1] - self.centre[1]
        dx, dy = abs(c * x + s * y) - self.half[0], abs(c * y - s * x) - self.half[1]
        return hypot(max(dx, 0.0), max(dy, 0.0)) + min(max(dx, dy), 0.0)

    def corners(self) -> list[Point]:
        """All four."""
        c, s = cos(self.yaw), sin(self.yaw)
        ends = [(u * self.half[0], v * self.half[1]) for u in (-1, 1) for v in (-1, 1)]
        return [(self.centre[0] + c * x - s * y, self.centre[1] + s * x + c * y) for x, y in ends]

    def overlaps(self, other: "Box") -> bool:
        """Whether the boxes overlap: no side of either separates them."""
        for yaw in (self.yaw, other.yaw):
            for nx, ny in ((cos(yaw), sin(yaw)), (-sin(yaw), cos(yaw))):
                mine, theirs = ([nx * x + ny * y for x, y in box.corners()] for box in (self, other))
                if max(mine) < min(theirs) + TOUCH or max(theirs) < min(mine) + TOUCH:
                    return False
        return True


class Strip:
    """The area that a disc sweeps between two points; a share of the length is left out at both ends."""

    def __init__(self, start: Point, end: Point, share: float, radius: float):
        (x0, y0), (x1, y1) = start, end
        dx, dy = x1 - x0, y1 - y0
        self._ends = ((x0 + share * dx, y0 + share * dy), (x1 - share * dx, y1 - share * dy))
        self._reach, self._radius = (0.5 - share) * hypot(dx, dy), radius
        centre = (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        self._between = Box("", centre, atan2(dy, dx), (self._reach, radius), 0.0)

    def meets(self, body: Disc | Box) -> bool:
        """Whether the area overlaps a body: its rectangle does, or the disc at one of its ends."""
        if body.distance(self._between.centre) > self._reach + self._radius:
            return False
        missing = self._radius - min(map(body.distance, self._ends))
        if missing > TOUCH:
            return True
        if isinstance(body, Disc):
            return self._between.distance(body.centre) < body.radius - TOUCH
        return self._between.overlaps(body)


def wall_box(key: str, wall: Wall) -> Box:
    """The wall's rectangle."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    half = (0.5 * hypot(x1 - x0, y1 - y0), 0.5 * wall.thickness)
    return Box(key, (0.5 * (x0 + x1), 0.5 * (y0 + y1)), atan2(y1 - y0, x1 - x0), half, wall.height)


def top_box(key: str, table: Table) -> Box:
    """The rectangle around a table's legs, which people walk around."""
    half = (0.5 * table.size[0] + table.leg_radius, 0.5 * table.size[1] + table.leg_radius)
    return Box(key, table.position, table.yaw, half, table.height)


def leg_discs(key: str, table: Table) -> Iterator[Disc]:
    """A table's four legs."""
    for x, y in table.legs:
        yield Disc(key, (float(x), float(y)), table.leg_radius, table.height)


def pillar_disc(key: str, pillar: Pillar) -> Disc:
    """As it stands on the floor."""
    return Disc(key, pillar.position, pillar.radius, pillar.height)


def met_by_people(walls: Sequence[Wall], tables: Sequence[Table], pillars: Sequence[Pillar]) -> list[Box | Disc]:
    """What people walk around: walls, whole tables, pillars."""
    return [
        *(wall_box(f"walls.{i}", wall) for i, wall in enumerate(walls)),
        *(top_box(f"tables.{i}", table) for i, table in enumerate(tables)),
        *(pillar_disc(f"pillars.{i}", pillar) for i, pillar in enumerate(pillars)),
    ]


def met_by_robot(walls: Sequence[Wall], tables: Sequence[Table], pillars: Sequence[Pillar]) -> list[Box | Disc]:
    """What the robot drives around: walls, legs of tables, pillars."""
    return [
        *(wall_box(f"walls.{i}", wall) for i, wall in enumerate(walls)),
        *(leg for i, table in enumerate(tables) for leg in leg_discs(f"tables.{i}", table)),
        *(pillar_disc(f"pillars.{i}", pillar) for i, pillar in enumerate(pillars)),
    ]
