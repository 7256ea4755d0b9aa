"""Walks of people: what all share, from waypoint to waypoint, straight on without or with pauses, and as recorded.

A recorded person's velocity leads along the track until the next decision.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from math import hypot
from types import MappingProxyType
from typing import ClassVar, TypeVar

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.messages import Array, WorldState
from mjnav.scene.crowd import TrackSplines
from mjnav.scene.people import MAX_WALKING_SPEED, PERIOD, REACHED, Replay, Walker
from mjnav.scene.ranges import Point
from mjnav.scene.spec import ConstantVelocity, Scenario, StopAndGo
from mjnav.world.people.guide import Guide

B = TypeVar("B")
ARRIVAL_TIME = 0.8  # [s] in which the distance to the last waypoint falls to 1/e
NEARLY = 1.0 + 1e-9  # of squares of distances: who is left out by it is too far by any rounding


# ------------------------------------------------------------------------------ shared by all walks


class Walk(ABC):
    """How the n people walk who have one behaviour, and who all see the robot or all do not.

    Made as Class(scenario, index, seed): `index` (n,) are their places in `scenario.people` and in the arrays of a
    WorldState; random draws come from `mjnav.rng.stream(seed, "behaviour.NAME", "personI")` alone. It is asked every
    PERIOD of simulated time, never at the control rate, and keeps its own state, such as the next waypoint.
    """

    tempers: ClassVar[bool] = False  # whether the walk asks the people's temperaments itself
    sidesteps = True  # whether its people go round whom they touch (`sidestepped`)
    heeds_robot: ClassVar[bool] = True  # whether the robot's pose and twist matter to it

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        self.index = index

    def behaviours(self, scenario: Scenario, kind: type[B]) -> list[B]:
        """Of its people, who all have one of this kind."""
        behaviours = [scenario.people[i].behaviour for i in self.index]
        return [behaviour for behaviour in behaviours if isinstance(behaviour, kind)]

    @abstractmethod
    def velocities(self, world: WorldState) -> Array:
        """(n, 2) [m/s], from the true state of the robot and of all P people.

        For people who do not see the robot its pose and twist are NaN. Positions of people who are not there are NaN,
        and what is returned for them is not used.
        """

    def arrived(self, world: WorldState) -> Flags:
        """(n,) whose way is over, so that they leave the scene; nobody's unless the behaviour says so."""
        return np.zeros(len(self.index), bool)

    def begin(self, place: int, start: Point, goal: Point) -> None:
        """The person at `place` of `index` comes again at `start` and walks to `goal`; for who has trips."""
        raise NotImplementedError(f"{type(self).__name__} has no trips")


# ------------------------------------------------------------------------ from waypoint to waypoint


class Route(Walk):
    """From waypoint to waypoint at constant speed; the last one, unless the route loops, is approached and kept."""

    heeds_robot = False

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        routes = self.behaviours(scenario, Walker)
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


# -------------------------------------------------------------------------------------- straight on


class Straight(Walk):
    """Constant velocity, in turns with standing still: moving while time mod (go + stop) < go."""

    heeds_robot = False

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        behaviours = [*self.behaviours(scenario, ConstantVelocity), *self.behaviours(scenario, StopAndGo)]
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


# -------------------------------------------------------------------------------------- as recorded


# [s] in which people take the velocity that they want: 70 kg pushed with 400 N s/m in MuJoCo (models/pedestrian.xml).
LAG: Mapping[str, float] = MappingProxyType({"mujoco": 0.175, "kinematic": 0.0})
GAIN = 2.9  # [1/s] of the way back to the track: with that lag it swings with a damping of 0.7
CATCH_UP = 1.0  # [m/s] fastest way back to the track, beside the track's own speed


class Replayed(Walk):
    """v(t) = (p(s + PERIOD) - p(s)) / PERIOD + min(GAIN |e|, CATCH_UP) e/|e| with s = t + LAG, e = p(t) - position.

    p is the spline. Where velocities are obeyed at once, who is on the track stays on it exactly.
    """

    heeds_robot = False

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        self._splines = TrackSplines([np.array(replay.track) for replay in self.behaviours(scenario, Replay)])
        self._lag = LAG[scenario.physics.engine]

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        # NaN: who is not there
        back = GAIN * np.nan_to_num(self._splines.positions(world.time) - world.people_position[self.index])
        along = self._splines.velocities(world.time, PERIOD, self._lag)
        return _limited(along + _limited(back, CATCH_UP), MAX_WALKING_SPEED)


def _limited(velocity: Array, highest: float) -> Array:
    """Velocities (n, 2), none faster than `highest`."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return velocity * (highest / np.maximum(speed, highest))[:, None]
