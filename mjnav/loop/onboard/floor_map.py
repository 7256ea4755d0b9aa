"""The known map as controllers use it: legs and pillars as discs at rest, walls as the faces towards the robot."""

from itertools import repeat

import numpy as np

from mjnav.constant import Constant
from mjnav.messages import Array, KnownMap, ObstacleSamples
from mjnav.scenarios.spec import Scenario
from mjnav.sealed import sealed


class FloorMap(Constant):
    """Static obstacles of the map that the robot has, with their names for the log."""

    def __init__(self, scenario: Scenario):
        known = scenario.known_bodies
        tables = zip(known.tables, known.table_names, strict=True)
        legs = [(leg, table.leg_radius, name) for table, name in tables for leg in table.legs]
        pillars = [
            (np.array(p.position), p.radius, name) for p, name in zip(known.pillars, known.pillar_names, strict=True)
        ]
        discs = [*legs, *pillars]
        self._positions = np.array([at for at, *_ in discs]).reshape(-1, 1, 2)
        self._radii = tuple(radius for _, radius, _ in discs)
        self.names = tuple(name for *_, name in discs)
        self.wall_names = known.wall_names

        start = np.array([wall.start for wall in known.walls], float).reshape(-1, 2)
        end = np.array([wall.end for wall in known.walls], float).reshape(-1, 2)
        half = 0.5 * np.array([[wall.thickness] for wall in known.walls]).reshape(-1, 1)
        along = end - start
        along = along / np.linalg.norm(along, axis=1, keepdims=True)
        self._across = half * np.stack([-along[:, 1], along[:, 0]], axis=1)
        self._middle = (start * self._across).sum(axis=1)
        # A face is as long as the wall with its two ends. The second is the one to the left of start-end.
        ends = np.stack([start - half * along, end + half * along], axis=1)
        self._faces = np.stack([ends - self._across[:, None], ends + self._across[:, None]], axis=1)  # (W, 2, 2, 2)
        self._index = np.arange(len(ends))
        self._walls, self._thickness = sealed(np.stack([start, end], axis=1)), sealed(2.0 * half[:, 0])
        self._discs = sealed(np.column_stack([self._positions[:, 0], self._radii]))
        self._lanes = scenario.lanes

    @property
    def known(self) -> KnownMap:
        """The map as an observation carries it, sealed."""
        left, right = (None, None) if self._lanes is None else (self._lanes.left, self._lanes.right)
        return KnownMap(self._walls, self._thickness, self._discs, left, right)

    @property
    def discs(self) -> tuple[ObstacleSamples, ...]:
        """Legs and pillars, sealed, one sample each."""
        positions, at_rest = sealed(self._positions), sealed(np.zeros((1, 2)))
        return tuple(map(ObstacleSamples, positions, repeat(at_rest), self._radii))

    def walls(self, position: Array) -> Array:
        """The face of each wall on the side of `position` (2,): start and end, (W, 2, 2)."""
        left = self._across @ position >= self._middle
        return self._faces[self._index, left.astype(int)]
