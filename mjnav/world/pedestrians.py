"""How people want to walk: one class a behaviour, deciding for all the people who have it.

A behaviour may see the robot and all people. It decides on a grid of simulated time (`PERIOD`), never at the control
rate, and keeps its own state, such as the next waypoint.
"""

from collections.abc import Callable, Mapping, Sequence
from math import hypot
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array, WorldState
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.people import REACHED
from mjnav.scenarios.spec import ConstantVelocity, Person, Scenario, StopAndGo, Waypoints
from mjnav.world.own_walk import OwnWalk

Index = NDArray[np.int64]  # positions in the list of all people

PERIOD = 0.02  # [s] between decisions
ARRIVAL_TIME = 0.8  # [s] in which the distance to the last waypoint falls to 1/e


class Walk(Protocol):
    """The desired velocities of the n people who have one behaviour."""

    def velocities(self, world: WorldState) -> Array:
        """(n, 2) [m/s], from the true state of the robot and of all P people."""
        ...


class Straight:
    """Constant velocity, in turns with standing still: moving while time mod (go + stop) < go."""

    def __init__(self, people: Sequence[Person], index: Index):
        behaviours = [
            person.behaviour for person in people if isinstance(person.behaviour, ConstantVelocity | StopAndGo)
        ]
        self._velocity = np.array([behaviour.velocity for behaviour in behaviours], float)  # (n, 2)
        self._phases = [
            (behaviour.go_time, behaviour.go_time + behaviour.stop_time) if isinstance(behaviour, StopAndGo) else None
            for behaviour in behaviours
        ]
        self._pauses = any(self._phases)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        if not self._pauses:
            return self._velocity
        time = world.time + 1e-9  # the grid's rounding must not move a phase's end by one decision
        walking = [phases is None or time % phases[1] < phases[0] for phases in self._phases]
        return self._velocity if all(walking) else self._velocity * np.array(walking, float)[:, None]


class Route:
    """From waypoint to waypoint at constant speed; the last one, unless the route loops, is approached and kept."""

    def __init__(self, people: Sequence[Person], index: Index):
        self._index = index
        routes = [person.behaviour for person in people if isinstance(person.behaviour, Waypoints)]
        self._routes = [(route.waypoints, route.speed, route.loop and len(route.waypoints) > 1) for route in routes]
        self._next = [0] * len(routes)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        desired = []
        for i, (x, y) in enumerate(world.people_position[self._index].tolist()):
            waypoints, speed, loops = self._routes[i]
            target = waypoints[self._next[i]]
            if hypot(target[0] - x, target[1] - y) <= REACHED and (loops or self._next[i] + 1 < len(waypoints)):
                self._next[i] = (self._next[i] + 1) % len(waypoints)
                target = waypoints[self._next[i]]
            dx, dy = target[0] - x, target[1] - y
            distance = hypot(dx, dy)
            if not loops and self._next[i] + 1 == len(waypoints):
                speed = min(speed, distance / ARRIVAL_TIME)
            scale = speed / distance if distance > 0.0 else 0.0
            desired.append((scale * dx, scale * dy))
        return np.array(desired)


# Of mjnav's own behaviours, which draw nothing; a user's own are `OwnWalk`.
WALKS: Mapping[type, Callable[[Sequence[Person], Index], Walk]] = MappingProxyType(
    {ConstantVelocity: Straight, StopAndGo: Straight, Waypoints: Route}
)


class Pedestrians:
    """All people, each with their behaviour."""

    def __init__(self, scenario: Scenario, seed: int):
        people = scenario.people
        self._num_people = len(people)
        self._groups: list[tuple[Index | slice, Walk]] = []
        for behaviour in dict.fromkeys(type(person.behaviour) for person in people):
            index = np.array([i for i, person in enumerate(people) if type(person.behaviour) is behaviour])
            first, last = int(index[0]), int(index[-1]) + 1
            together = last - first == len(index)  # a slice is written to in a third of the time
            place = slice(first, last) if together else index
            if behaviour is BehaviourPlugin:
                walk: Walk = OwnWalk(scenario, index, seed)
            else:
                walk = WALKS[behaviour]([people[i] for i in index], index)
            self._groups.append((place, walk))

    def velocities(self, world: WorldState) -> Array:
        """Desired velocities of all people, (P, 2) [m/s]."""
        desired = np.zeros((self._num_people, 2))
        for place, walk in self._groups:
            desired[place] = walk.velocities(world)
        return desired
