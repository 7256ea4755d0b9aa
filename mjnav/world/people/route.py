"""From waypoint to waypoint."""

from math import hypot

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Flags, Indices, Matrix, Vector
from mjnav.messages import Array, WorldState
from mjnav.scenarios.people import REACHED, Walker
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.guide import Guide
from mjnav.world.people.walk import ARRIVAL_TIME, NEARLY, Walk


class Route(Walk):
    """From waypoint to waypoint at constant speed; the last one, unless the route loops, is approached and kept."""

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        routes = [behaviour for behaviour in found if isinstance(behaviour, Walker)]
        within = [-1.0 if route.leaves_within is None else route.leaves_within for route in routes]
        self._leaves_within = np.array(within, float)  # of the last waypoint [m]; negative for who stays
        self._leaves = bool((self._leaves_within >= 0.0).any())
        self._waypoints = [route.waypoints for route in routes]
        self._loops = [route.loop and len(route.waypoints) > 1 for route in routes]
        self._speed = np.array([route.speed for route in routes], float)
        self._next = [0] * len(routes)
        self._goals = np.array([waypoints[0] for waypoints in self._waypoints], float)
        self._ends = np.array([self._is_end(i) for i in range(len(routes))])  # whose next waypoint is where they stay
        self._guide = Guide(scenario, index)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        positions = world.people_position[self.index]
        for i in _perhaps_reached(self._goals, positions, self._ends).tolist():
            if hypot(*(self._goals[i] - positions[i]).tolist()) <= REACHED:
                self._next[i] = (self._next[i] + 1) % len(self._waypoints[i])
                self._goals[i], self._ends[i] = self._waypoints[i][self._next[i]], self._is_end(i)
        points = self._guide.towards(positions, self._goals)
        way = points - positions
        return _velocities(way, np.array(_lengths(way)), points, self._goals, self._speed, self._ends)

    def arrived(self, world: WorldState) -> Flags:
        """See `Walk`: who is near the last waypoint, and leaves there."""
        if not self._leaves:
            return super().arrived(world)
        position = np.ascontiguousarray(world.people_position)
        return _near_the_end(self._goals, position, self.index, self._ends, self._leaves_within)

    def begin(self, place: int, start: Point, goal: Point) -> None:
        """See `Walk`."""
        self._waypoints[place], self._next[place] = (goal,), 0
        self._goals[place], self._ends[place] = goal, True

    def _is_end(self, i: int) -> bool:
        return not self._loops[i] and self._next[i] + 1 == len(self._waypoints[i])


@exact
def _perhaps_reached(goals: Matrix, position: Matrix, ends: Flags):
    """Who is within REACHED of a goal where the route goes on, or so little beyond that rounding decides."""
    found, num = np.empty(len(goals), np.int64), 0
    for i in range(len(goals)):
        dx, dy = goals[i, 0] - position[i, 0], goals[i, 1] - position[i, 1]
        if not ends[i] and dx * dx + dy * dy <= NEARLY * REACHED**2:
            found[num] = i
            num += 1
    return found[:num]


@exact
def _velocities(way: Matrix, distance: Vector, points: Matrix, goals: Matrix, speed: Vector, ends: Flags):
    """Along `way` (n, 2), `distance` (n,) long, to `points`; slower by and by to a goal where the route `ends`."""
    found = np.empty(way.shape)
    for i in range(len(way)):
        walks, share = speed[i], 0.0
        if ends[i] and max(abs(points[i, 0] - goals[i, 0]), abs(points[i, 1] - goals[i, 1])) <= REACHED:
            walks = min(walks, distance[i] / ARRIVAL_TIME)
        if distance[i] > 0.0:
            share = walks / distance[i]
        found[i, 0], found[i, 1] = share * way[i, 0], share * way[i, 1]
    return found


@exact
def _near_the_end(goals: Matrix, position: Matrix, index: Indices, ends: Flags, within: Vector):
    """Who of n people, whose places in `position` are `index`, is `within` a distance [m] of where the route ends."""
    near = np.zeros(len(goals), np.bool_)
    for i in range(len(goals)):
        x, y = goals[i, 0] - position[index[i], 0], goals[i, 1] - position[index[i], 1]
        near[i] = ends[i] and np.hypot(x, y) <= within[i]
    return near


def _lengths(vectors: Array) -> list[float]:
    """Of each row (n, 2). Rounded as math.hypot does, and not as NumPy does: it is part of what a seed leads to."""
    return list(map(hypot, *vectors.T.tolist()))
