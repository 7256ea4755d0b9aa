"""Bodies that stand still in a scene (walls, tables, pillars, lane boundaries), and their shapes seen from above.

Each shape has the key of its body in the run file.

The table [estimation.map] of a run file says how the map that the robot has differs from the world. Estimators and
controllers go by this map; the world, the referee and the metrics by what stands there.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from math import cos, hypot, sin
from typing import Annotated, TypeVar

import numpy as np

from mjnav.constant import Constant
from mjnav.errors import InvalidValue, unknown_name
from mjnav.geometry.floor import TOUCH
from mjnav.messages import Array
from mjnav.scene.ranges import MAX_BODIES, MAX_LENGTH, MAX_WALLS, MIN_SIZE, Angle, Coordinate, Line, Point, Size
from mjnav.settings import Choice, Key, Length, Range, Settled, below


@dataclass(frozen=True, slots=True)
class Wall(Settled):
    """A straight wall between two points."""

    start: Annotated[Point, Key("from"), "one end"]
    end: Annotated[Point, Key("to"), "the other end"]
    thickness: Annotated[Size, "half of it on each side of the line"] = 0.1
    height: Annotated[Size, "above the floor"] = 1.0

    def _check(self):
        if hypot(self.end[0] - self.start[0], self.end[1] - self.start[1]) < MIN_SIZE:
            raise InvalidValue("to", self.end, f"a point other than `from`, at least {MIN_SIZE:g} m away")


@dataclass(frozen=True, slots=True)
class Table(Settled):
    """A table on four legs; `size` is measured between the legs' centres."""

    position: Annotated[Point, "of its centre"]
    yaw: Annotated[Angle, "of its long side, counter-clockwise from x"] = 0.0
    size: Annotated[tuple[Size, Size], "between the centres of the legs"] = (1.6, 0.8)
    leg_radius: Annotated[Size, "of each leg"] = 0.03
    height: Annotated[float, Range(0.5, MAX_LENGTH, "m"), "of its top above the floor"] = 0.74

    def _check(self):
        for i, side in enumerate(self.size):
            Range(2.0 * self.leg_radius, MAX_LENGTH, "m", open_low=True).check(f"size.{i}", side)

    @property
    def legs(self) -> Array:
        """Centres of the four legs, (4, 2)."""
        corners = 0.5 * np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * self.size
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.asarray(self.position) + corners @ np.array([[c, s], [-s, c]])


@dataclass(frozen=True, slots=True)
class Pillar(Settled):
    """A round pillar."""

    position: Annotated[Point, "of its centre"]
    radius: Annotated[Size, "of the pillar"] = 0.2
    height: Annotated[Size, "above the floor"] = 1.0


@dataclass(frozen=True, slots=True)
class LaneSpec(Settled):
    """Two lines a x + b y + c = 0; the left one keeps d <= 0, the right one d >= 0."""

    left: Annotated[Line, "a, b, c of the left boundary"]
    right: Annotated[Line, "a, b, c of the right boundary"]

    def _check(self):
        for key in ("left", "right"):
            line = getattr(self, key)
            if hypot(line[0], line[1]) < MIN_SIZE:
                raise InvalidValue(key, line, f"a line a x + b y + c = 0, (a, b) at least {MIN_SIZE:g} long")


# --------------------------------------------------------------------------- shapes seen from above


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
    along: Point  # unit vector of the first side
    half: Point  # half the sides
    height: float

    def distance(self, point: Point) -> float:
        """From the surface to a point [m], negative inside."""
        (c, s), x, y = self.along, point[0] - self.centre[0], point[1] - self.centre[1]
        dx, dy = abs(c * x + s * y) - self.half[0], abs(c * y - s * x) - self.half[1]
        return hypot(max(dx, 0.0), max(dy, 0.0)) + min(max(dx, dy), 0.0)

    def corners(self) -> list[Point]:
        """All four."""
        c, s = self.along
        ends = [(u * self.half[0], v * self.half[1]) for u in (-1, 1) for v in (-1, 1)]
        return [(self.centre[0] + c * x - s * y, self.centre[1] + s * x + c * y) for x, y in ends]

    def overlaps(self, other: "Box") -> bool:
        """Whether the boxes overlap: no side of either separates them."""
        for c, s in (self.along, other.along):
            for nx, ny in ((c, s), (-s, c)):
                mine, theirs = ([nx * x + ny * y for x, y in box.corners()] for box in (self, other))
                if max(mine) < min(theirs) + TOUCH or max(theirs) < min(mine) + TOUCH:
                    return False
        return True


class Strip:
    """The area that a disc sweeps between two points; a share of the length is left out at both ends.

    In place of `Floor.blocking`, which loads compiled code: commands that only print check a scene, too.
    """

    def __init__(self, start: Point, end: Point, share: float, radius: float):
        (x0, y0), (x1, y1) = start, end
        dx, dy = x1 - x0, y1 - y0
        length = hypot(dx, dy)
        self._ends = ((x0 + share * dx, y0 + share * dy), (x1 - share * dx, y1 - share * dy))
        self._reach, self._radius = (0.5 - share) * length, radius
        along = (dx / length, dy / length) if length > 0.0 else (1.0, 0.0)
        self._between = Box("", (0.5 * (x0 + x1), 0.5 * (y0 + y1)), along, (self._reach, radius), 0.0)

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
    length = hypot(x1 - x0, y1 - y0)
    along = ((x1 - x0) / length, (y1 - y0) / length)
    return Box(key, (0.5 * (x0 + x1), 0.5 * (y0 + y1)), along, (0.5 * length, 0.5 * wall.thickness), wall.height)


def top_box(key: str, table: Table) -> Box:
    """The rectangle around a table's legs, which people walk around."""
    half = (0.5 * table.size[0] + table.leg_radius, 0.5 * table.size[1] + table.leg_radius)
    return Box(key, table.position, (cos(table.yaw), sin(table.yaw)), half, table.height)


def leg_discs(key: str, table: Table) -> Iterator[Disc]:
    """A table's four legs."""
    for x, y in table.legs:
        yield Disc(key, (float(x), float(y)), table.leg_radius, table.height)


def pillar_disc(key: str, pillar: Pillar) -> Disc:
    """As it stands on the floor."""
    return Disc(key, pillar.position, pillar.radius, pillar.height)


def met_by_people(walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> list[Box | Disc]:
    """What people walk around: pillars, walls, whole tables."""
    return [
        *(pillar_disc(f"pillars.{i}", pillar) for i, pillar in enumerate(pillars)),
        *(wall_box(f"walls.{i}", wall) for i, wall in enumerate(walls)),
        *(top_box(f"tables.{i}", table) for i, table in enumerate(tables)),
    ]


def met_by_robot(walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> list[Box | Disc]:
    """What the robot drives around: legs of tables, pillars, walls."""
    return [
        *(leg for i, table in enumerate(tables) for leg in leg_discs(f"tables.{i}", table)),
        *(pillar_disc(f"pillars.{i}", pillar) for i, pillar in enumerate(pillars)),
        *(wall_box(f"walls.{i}", wall) for i, wall in enumerate(walls)),
    ]


# ------------------------------------------------------------------------ the map that the robot has


_Names = tuple[str, ...]
B = TypeVar("B", Wall, Table, Pillar)


@dataclass(frozen=True, slots=True)
class KnownBodies(Constant):
    """What stands on the robot's map, each body with its name: "wall0", "table2", "pillar1"."""

    walls: tuple[Wall, ...]
    tables: tuple[Table, ...]
    pillars: tuple[Pillar, ...]
    wall_names: _Names
    table_names: _Names
    pillar_names: _Names

    @classmethod
    def of(cls, walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> "KnownBodies":
        """All bodies of a scene, named by their places in the run file."""
        bodies = tuple(walls), tuple(tables), tuple(pillars)
        kinds = zip(("wall", "table", "pillar"), bodies, strict=True)
        return cls(*bodies, *(tuple(f"{kind}{i}" for i in range(len(found))) for kind, found in kinds))

    @property
    def names(self) -> _Names:
        """Of all bodies."""
        return self.wall_names + self.table_names + self.pillar_names


@dataclass(frozen=True, slots=True)
class MapDifference(Settled):
    """How the map that estimators and controllers have differs from the world, or that they have none.

    Both have the same frame: starts, goals and people's positions mean the same place in either.
    """

    source: Annotated[
        str,
        Choice(("world", "lidar", "both")),
        "world: the world's bodies, but for the differences below; lidar: none, but what the robot's own scans show "
        "while it drives; both: the world's, and what the scans show besides",
    ] = "world"
    shift: Annotated[
        tuple[Coordinate, Coordinate, Angle],
        "dx, dy and turn about its own centre: how far the map has each body of `shifted` from where it stands; goals "
        "stay where they are",
    ] = (0.0, 0.0, 0.0)
    shifted: Annotated[
        tuple[str, ...] | None,
        Length(0, 2 * MAX_BODIES + MAX_WALLS),
        'names ("table0", "wall2"); by default all tables and pillars',
    ] = None
    missing: Annotated[
        tuple[str, ...],
        Length(0, 2 * MAX_BODIES + MAX_WALLS),
        'names ("table0", "pillar1", "wall2") of what the map does not have',
    ] = ()
    walls: Annotated[tuple[Wall, ...], Length(0, MAX_WALLS), "of the map alone"] = ()
    tables: Annotated[tuple[Table, ...], Length(0, MAX_BODIES), "of the map alone"] = ()
    pillars: Annotated[tuple[Pillar, ...], Length(0, MAX_BODIES), "of the map alone"] = ()

    def _check(self):
        differences = [f for f in fields(self) if f.name != "source" and getattr(self, f.name) != f.default]
        if self.source == "lidar" and differences:
            key = differences[0].name
            raise InvalidValue(key, getattr(self, key), 'nothing where source is "lidar": there is no map before')

    def applied(self, world: KnownBodies) -> KnownBodies:
        """The map of a world; what it has beyond that is named on. Raises InvalidValue for a name that is none."""
        if self.source == "lidar":
            return KnownBodies.of((), (), ())
        for key in ("shifted", "missing"):
            for i, name in enumerate(getattr(self, key) or ()):
                if name not in world.names:
                    with below(key):
                        raise _no_such_body(str(i), name, world.names)
        whole = KnownBodies.of(
            [*world.walls, *self.walls], [*world.tables, *self.tables], [*world.pillars, *self.pillars]
        )
        shifted = world.table_names + world.pillar_names if self.shifted is None else self.shifted
        walls, wall_names = self._known(whole.walls, whole.wall_names, shifted)
        tables, table_names = self._known(whole.tables, whole.table_names, shifted)
        pillars, pillar_names = self._known(whole.pillars, whole.pillar_names, shifted)
        return KnownBodies(walls, tables, pillars, wall_names, table_names, pillar_names)

    def _known(
        self, bodies: Iterable[B], names: Iterable[str], shifted: Iterable[str]
    ) -> tuple[tuple[B, ...], tuple[str, ...]]:
        """What the map has of one kind, where the map has it, and its names."""
        with below("shift"):
            known = [
                (self._moved(body) if name in shifted else body, name)
                for body, name in zip(bodies, names, strict=True)
                if name not in self.missing
            ]
        return tuple(body for body, _ in known), tuple(name for _, name in known)

    def _moved(self, body: B) -> B:
        """A body where the map has it."""
        dx, dy, turn = self.shift
        if isinstance(body, Wall):
            (x0, y0), (x1, y1) = body.start, body.end
            x, y, ux, uy = 0.5 * (x0 + x1) + dx, 0.5 * (y0 + y1) + dy, 0.5 * (x1 - x0), 0.5 * (y1 - y0)
            half = (cos(turn) * ux - sin(turn) * uy, sin(turn) * ux + cos(turn) * uy)
            return replace(body, start=(x - half[0], y - half[1]), end=(x + half[0], y + half[1]))
        position = (body.position[0] + dx, body.position[1] + dy)
        if isinstance(body, Table):
            return replace(body, position=position, yaw=body.yaw + turn)
        return replace(body, position=position)


def _no_such_body(key: str, name: str, names: _Names) -> InvalidValue:
    if not names:
        return InvalidValue(key, name, "no name: the scene has no walls, tables or pillars")
    return unknown_name(key, name, names)
