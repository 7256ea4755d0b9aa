"""The floor that a scene leaves: what stands in the way of the robot, and of people.

The robot passes under tables and meets their legs; people walk around the whole table.
"""

from collections.abc import Iterable
from math import cos, hypot, sin
from typing import TypeVar

import numpy as np

from mjnav.geometry.floor import Floor
from mjnav.motion.diff_drive import LIDAR_HEIGHT
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.known_map import KnownBodies

B = TypeVar("B", Wall, Table, Pillar)


def floor_of_robot(walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> Floor:
    """Legs, then pillars, as discs; walls as boxes."""
    legs = [(*leg, table.leg_radius) for table in tables for leg in table.legs]
    return _floor([*legs, *map(_pillar_disc, pillars)], map(_wall_box, walls))


def floor_of_lidar(known: KnownBodies) -> Floor:
    """What the robot's map has at the height of the lidar: legs, then pillars, as discs; walls as boxes."""
    return floor_of_robot(_high(known.walls), _high(known.tables), _high(known.pillars))


def floor_of_people(walls: Iterable[Wall], tables: Iterable[Table], pillars: Iterable[Pillar]) -> Floor:
    """Pillars as discs; walls, then tables' tops, as boxes."""
    return _floor(map(_pillar_disc, pillars), [*map(_wall_box, walls), *map(_top_box, tables)])


def _floor(discs: Iterable[tuple[float, ...]], boxes: Iterable[tuple[float, ...]]) -> Floor:
    return Floor(np.array(list(discs), float).reshape(-1, 3), np.array(list(boxes), float).reshape(-1, 6))


def _high(bodies: Iterable[B]) -> list[B]:
    return [body for body in bodies if body.height > LIDAR_HEIGHT]


def _pillar_disc(pillar: Pillar) -> tuple[float, ...]:
    return *pillar.position, pillar.radius


def _wall_box(wall: Wall) -> tuple[float, ...]:
    (x0, y0), (x1, y1) = wall.start, wall.end
    length = hypot(x1 - x0, y1 - y0)
    along = ((x1 - x0) / length, (y1 - y0) / length)
    return 0.5 * (x0 + x1), 0.5 * (y0 + y1), *along, 0.5 * length, 0.5 * wall.thickness


def _top_box(table: Table) -> tuple[float, ...]:
    half = (0.5 * side + table.leg_radius for side in table.size)
    return *table.position, cos(table.yaw), sin(table.yaw), *half
