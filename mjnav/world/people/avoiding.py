"""What people who avoid others have in common: where they want to go, and all bodies that a law looks at."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt
from typing import TypeVar

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Flags, Indices, Matrix, Vector
from mjnav.messages import Array, WorldState
from mjnav.rng import stream
from mjnav.scenarios.floor import floor_of_people
from mjnav.scenarios.people.avoiding import Avoiding
from mjnav.scenarios.people.straight import MAX_WALKING_SPEED
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Scenario
from mjnav.world.draws import Normal, Uniform
from mjnav.world.people.route import Route
from mjnav.world.people.temperament import Temperaments
from mjnav.world.people.walk import Walk

HALF_RIGHT = sqrt(0.5)  # cosine and sine of 45 degrees
# [rad] to the right of the way, where people want to walk, so that two who meet exactly head-on pass: the laws leave
# them standing before one another. Noise breaks such symmetries in the examples of ORCA's authors.
TO_THE_RIGHT = 0.02


Law = TypeVar("Law")


@dataclass(frozen=True, slots=True)
class Bodies:
    """The people of a scene, then the robot."""

    position: Array  # (P + 1, 2) [m], NaN for who is not there or not seen
    velocity: Array  # (P + 1, 2) [m/s]
    robot: int  # the robot's place


class AvoidingWalk(Walk):
    """People on a route who avoid others by a law; the law is the subclass's."""

    tempers = True

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        behaviours = [behaviour for behaviour in found if isinstance(behaviour, Avoiding)]
        self._route = Route(scenario, index, seed)
        self._temperaments = Temperaments(scenario, index)
        self._speed = np.array([behaviour.speed for behaviour in behaviours], float)
        self._radius = np.array([*(person.radius for person in scenario.people), scenario.robot.radius])
        self._floor = floor_of_people(scenario.walls, scenario.tables, scenario.pillars)
        self._decisions = 0
        self._diagonal = [
            _Turns(behaviours, every, index, seed)
            for every in sorted({one.diagonal.every for one in behaviours if one.diagonal is not None})
        ]
        self._turned = np.zeros(len(index), bool)
        self._std = np.array([behaviour.unsteadiness for behaviour in behaviours], float)
        self._unsteady = np.flatnonzero(self._std > 0.0)
        streams = [stream(seed, "behaviour.unsteadiness", f"person{index[i]}") for i in self._unsteady]
        self._noise = Normal(streams)

    def wanted(self, world: WorldState) -> Array:
        """(n, 2) [m/s] along the routes, changes of mind and temperaments included."""
        desired = self._route.velocities(world)
        for turns in self._diagonal:
            if self._decisions % turns.every == 0:
                self._turned[turns.drawn()] = True
        self._decisions += 1
        _turn(desired, self._turned)
        return self._temperaments.applied(world, desired)

    def arrived(self, world: WorldState) -> Flags:
        """See `Walk`."""
        return self._route.arrived(world)

    def begin(self, place: int, start: Point, goal: Point) -> None:
        """See `Walk`; whoever changed their mind walks straight again."""
        self._route.begin(place, start, goal)
        self._turned[place] = False

    def bodies(self, world: WorldState) -> Bodies:
        """Everybody, and the robot as one more: at NaN where these people do not see it."""
        (x, y, heading), speed = world.robot_pose.tolist(), float(world.robot_twist[0])
        robot = len(world.people_position)
        position, velocity = np.empty((2, robot + 1, 2))
        position[:robot], position[robot] = world.people_position, (x, y)
        velocity[:robot], velocity[robot] = world.people_velocity, (speed * cos(heading), speed * sin(heading))
        return Bodies(position, velocity, robot)

    def unsteady(self, velocities: Array) -> Array:
        """The velocities with the noise of those who walk unsteadily, at most MAX_WALKING_SPEED; drawn each time."""
        if not self._unsteady.size:
            return velocities
        return _shaken(velocities, self._unsteady, self._std, self._noise.row())


def groups(laws: Sequence[Law]) -> list[tuple[Indices, Law]]:
    """Who has the same law, and the law: one call of it moves them all."""
    return [(np.flatnonzero([other == one for other in laws]), one) for one in dict.fromkeys(laws)]


@exact
def _turn(desired: Matrix, diagonal: Flags):
    """Turns the velocities (n, 2) in place TO_THE_RIGHT, and those of who walks `diagonal` (n,) 45 degrees first."""
    for i in range(len(desired)):
        x, y = desired[i, 0], desired[i, 1]
        if diagonal[i]:
            x, y = HALF_RIGHT * (x - y), HALF_RIGHT * (x + y)
        desired[i, 0], desired[i, 1] = x + TO_THE_RIGHT * y, y - TO_THE_RIGHT * x


@exact
def _shaken(velocities: Matrix, unsteady: Indices, std: Vector, noise: Matrix):
    """The velocities (n, 2), those of who is `unsteady` (k,) with `std` (n,) times `noise` (k, 2)."""
    shaken = velocities.copy()
    for k in range(len(unsteady)):
        i = unsteady[k]
        x, y = velocities[i, 0] + std[i] * noise[k, 0], velocities[i, 1] + std[i] * noise[k, 1]
        share = MAX_WALKING_SPEED / max(np.hypot(x, y), MAX_WALKING_SPEED)
        shaken[i, 0], shaken[i, 1] = share * x, share * y
    return shaken


class _Turns:
    """The changes of mind of all who draw them equally often."""

    def __init__(self, behaviours: Sequence[Avoiding], every: int, index: Indices, seed: int):
        self.every = every
        given = [one.diagonal for one in behaviours]
        self._who = np.array([i for i, one in enumerate(given) if one is not None and one.every == every])
        self._probability = np.array([one.probability for one in given if one is not None and one.every == every])
        streams = [stream(seed, "behaviour.diagonal", f"person{index[i]}") for i in self._who]
        self._draws = Uniform(streams)

    def drawn(self) -> Indices:
        """Who turns now."""
        return self._who[self._draws.row() < self._probability]
