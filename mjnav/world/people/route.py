"""From waypoint to waypoint."""

from math import hypot

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.scenarios.people import REACHED
from mjnav.scenarios.spec import Scenario, Waypoints
from mjnav.world.people.guide import Guide
from mjnav.world.people.walk import Index, Walk

ARRIVAL_TIME = 0.8  # [s] in which the distance to the last waypoint falls to 1/e


class Route(Walk):
    """From waypoint to waypoint at constant speed; the last one, unless the route loops, is approached and kept."""

    def __init__(self, scenario: Scenario, index: Index, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        routes = [behaviour for behaviour in found if isinstance(behaviour, Waypoints)]
        self._routes = [(route.waypoints, route.speed, route.loop and len(route.waypoints) > 1) for route in routes]
        self._next = [0] * len(routes)
        self._goals = np.array([waypoints[0] for waypoints, _, _ in self._routes], float)
        self._guide = Guide(scenario, index)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        positions = world.people_position[self.index]
        for i, (x, y) in enumerate(positions.tolist()):
            waypoints, _, loops = self._routes[i]
            target = waypoints[self._next[i]]
            if hypot(target[0] - x, target[1] - y) <= REACHED and (loops or self._next[i] + 1 < len(waypoints)):
                self._next[i] = (self._next[i] + 1) % len(waypoints)
                self._goals[i] = waypoints[self._next[i]]
        points = self._guide.towards(positions, self._goals).tolist()
        desired = []
        for i, (x, y) in enumerate(positions.tolist()):
            waypoints, speed, loops = self._routes[i]
            dx, dy = points[i][0] - x, points[i][1] - y
            distance = hypot(dx, dy)
            ends = not loops and self._next[i] + 1 == len(waypoints)
            if ends and hypot(points[i][0] - waypoints[-1][0], points[i][1] - waypoints[-1][1]) <= REACHED:
                speed = min(speed, distance / ARRIVAL_TIME)
            scale = speed / distance if distance > 0.0 else 0.0
            desired.append((scale * dx, scale * dy))
        return np.array(desired)
