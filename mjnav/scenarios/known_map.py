"""The map that the robot has: the table [estimation.map] of a run file says how it differs from the world.

Estimators and controllers go by this map; the world, the referee and the metrics by what stands there.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import cos, sin
from typing import Annotated, TypeVar

from mjnav.config import Length, below, settle
from mjnav.constant import Constant
from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.ranges import MAX_BODIES, Angle, Coordinate

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
class MapDifference:
    """How the map that estimators and controllers have differs from the world.

    Both have the same frame: starts, goals and people's positions mean the same place in either.
    """

    shift: Annotated[
        tuple[Coordinate, Coordinate, Angle],
        "dx, dy and turn about its own centre: how far the map has each body of `shifted` from where it stands; goals "
        "stay where they are",
    ] = (0.0, 0.0, 0.0)
    shifted: Annotated[
        tuple[str, ...] | None,
        Length(0, 3 * MAX_BODIES),
        'names ("table0", "wall2"); by default all tables and pillars',
    ] = None
    missing: Annotated[
        tuple[str, ...], Length(0, 3 * MAX_BODIES), 'names ("table0", "pillar1", "wall2") of what the map does not have'
    ] = ()
    walls: Annotated[tuple[Wall, ...], Length(0, MAX_BODIES), "of the map alone"] = ()
    tables: Annotated[tuple[Table, ...], Length(0, MAX_BODIES), "of the map alone"] = ()
    pillars: Annotated[tuple[Pillar, ...], Length(0, MAX_BODIES), "of the map alone"] = ()

    def __post_init__(self):
        settle(self)

    def applied(self, world: KnownBodies) -> KnownBodies:
        """The map of a world; what it has beyond that is named on. Raises InvalidValue for a name that is none."""
        for key in ("shifted", "missing"):
            for i, name in enumerate(getattr(self, key) or ()):
                if name not in world.names:
                    with below(key):
                        raise _no_such(str(i), name, world.names)
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


def _no_such(key: str, name: str, names: _Names) -> InvalidValue:
    if not names:
        return InvalidValue(key, name, "no name: the scene has no walls, tables or pillars")
    return unknown_name(key, name, names)
