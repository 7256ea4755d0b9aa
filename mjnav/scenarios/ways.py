"""People's ways around walls and furniture, as the check of a run file and the people in a run both plan them."""

from collections.abc import Iterator
from functools import lru_cache
from math import ceil, hypot

import numpy as np

from mjnav.constant import Constant
from mjnav.geometry.floor import Floor
from mjnav.geometry.shortest_way import EXCESS, WayMap
from mjnav.messages import Array
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.floor import floor_of_people
from mjnav.scenarios.people import REACHED
from mjnav.scenarios.ranges import Point

MARGIN, STEP = 0.02, 0.05  # [m] least distance from bodies on the way, which is rounded up so that people share maps
NARROW_MARGIN = 0.005  # [m] where there is no way with more
_MOVED = REACHED - 0.01  # [m] that a person may end beside a waypoint that is too near to a body


class Ways(Constant):
    """The ways of all people of a scene; what one of them needed serves the next, and copies of a simulation."""

    def __init__(self, floor: Floor):
        """`floor` has what people walk around: `mjnav.scenarios.floor.floor_of_people`."""
        self.floor = floor
        self._maps: dict[float, WayMap] = {}

    def maps(self, radius: float) -> Iterator[WayMap]:
        """For a person of `radius` [m]: with room to spare, then, where that leads nowhere, as narrow as can be."""
        yield self._map(STEP * ceil((radius + MARGIN) / STEP), EXCESS)
        yield self._map(radius + NARROW_MARGIN, NARROW_MARGIN)

    def _map(self, reach: float, excess: float) -> WayMap:
        if reach not in self._maps:
            self._maps[reach] = WayMap(self.floor, reach, excess)
        return self._maps[reach]

    def plan(self, start: Point, goal: Point, radius: float) -> Array | None:
        """The points (k, 2) [m] of the shortest way after its start, or None; it may end REACHED beside the goal."""
        for ways in self.maps(radius):
            begin, end = ways.anchor(start), end_of(ways, goal)
            if begin is not None and end is not None:
                found = ways.way(begin, end)
                if found is not None:
                    return found
        return None


@lru_cache(maxsize=16)
def ways_of(walls: tuple[Wall, ...], tables: tuple[Table, ...], pillars: tuple[Pillar, ...]) -> Ways:
    """The ways of a scene: a run file's check, every behaviour and the episodes of a sweep share their maps."""
    return Ways(floor_of_people(walls, tables, pillars))


def end_of(ways: WayMap, goal: Point) -> Array | None:
    """Where a way to a waypoint ends, (2,) [m]: there, or beside it where a body stands; None where it is too near."""
    end = ways.anchor(goal)
    return None if end is None or hypot(*(end - np.asarray(goal))) > _MOVED else end
