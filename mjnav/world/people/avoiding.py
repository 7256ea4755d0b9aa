"""What people who avoid others have in common: where they want to go, and all bodies that a law looks at."""

from dataclasses import dataclass
from math import cos, hypot, sin, sqrt

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.rng import stream
from mjnav.scenarios.floor import floor_of_people
from mjnav.scenarios.people.avoiding import Avoiding
from mjnav.scenarios.people.straight import MAX_WALKING_SPEED
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.route import Route
from mjnav.world.people.temperament import Temperaments
from mjnav.world.people.walk import Index, Walk

HALF_RIGHT = sqrt(0.5)  # cosine and sine of 45 degrees
# [rad] to the right of the way, where people want to walk, so that two who meet exactly head-on pass: the laws leave
# them standing before one another. Noise breaks such symmetries in the examples of ORCA's authors.
TO_THE_RIGHT = 0.02


@dataclass(frozen=True, slots=True)
class Bodies:
    """The people of a scene, then the robot."""

    position: Array  # (P + 1, 2) [m], NaN for who is not there or not seen
    velocity: Array  # (P + 1, 2) [m/s]
    robot: int  # the robot's place


class AvoidingWalk(Walk):
    """People on a route who avoid others by a law; the law is the subclass's."""

    tempers = True

    def __init__(self, scenario: Scenario, index: Index, seed: int):
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
            (i, behaviour.diagonal, stream(seed, "behaviour.diagonal", f"person{index[i]}"))
            for i, behaviour in enumerate(behaviours)
            if behaviour.diagonal is not None
        ]
        self._turned = np.zeros(len(index), bool)
        self._unsteady = [
            (i, behaviour.unsteadiness, stream(seed, "behaviour.unsteadiness", f"person{index[i]}"))
            for i, behaviour in enumerate(behaviours)
            if behaviour.unsteadiness > 0.0
        ]

    def wanted(self, world: WorldState) -> Array:
        """(n, 2) [m/s] along the routes, changes of mind and temperaments included."""
        desired = self._route.velocities(world)
        for i, diagonal, rng in self._diagonal:
            if self._decisions % diagonal.every == 0 and rng.random() < diagonal.probability:
                self._turned[i] = True
        self._decisions += 1
        if self._turned.any():
            x, y = desired[self._turned].T
            desired[self._turned] = HALF_RIGHT * np.stack([x - y, x + y], axis=-1)
        x, y = desired.T
        desired = np.stack([x + TO_THE_RIGHT * y, y - TO_THE_RIGHT * x], axis=-1)
        return self._temperaments.applied(world, desired)

    def bodies(self, world: WorldState) -> Bodies:
        """Everybody, and the robot as one more: at NaN where these people do not see it."""
        pose, speed = world.robot_pose.tolist(), float(world.robot_twist[0])
        robot = [speed * cos(pose[2]), speed * sin(pose[2])]
        return Bodies(
            np.concatenate([world.people_position, [pose[:2]]]),
            np.concatenate([world.people_velocity, [robot]]),
            len(world.people_position),
        )

    def unsteady(self, velocities: Array) -> Array:
        """The velocities with the noise of those who walk unsteadily, at most MAX_WALKING_SPEED; drawn each time."""
        if not self._unsteady:
            return velocities
        velocities = np.array(velocities)
        for i, std, rng in self._unsteady:
            velocities[i] += std * rng.standard_normal(2)
            velocities[i] *= min(1.0, MAX_WALKING_SPEED / max(hypot(*velocities[i]), 1e-9))
        return velocities
