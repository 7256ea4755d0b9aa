"""All people of a scene, each with their behaviour."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.people import Replay
from mjnav.scenarios.spec import ConstantVelocity, Scenario, StopAndGo, Waypoints
from mjnav.world.people.own import OwnWalk
from mjnav.world.people.replay import Replayed
from mjnav.world.people.route import Route
from mjnav.world.people.sidestep import sidestepped
from mjnav.world.people.straight import Straight
from mjnav.world.people.walk import Index, Walk

WALKS: Mapping[type, type[Walk]] = MappingProxyType(
    {ConstantVelocity: Straight, StopAndGo: Straight, Waypoints: Route, Replay: Replayed, BehaviourPlugin: OwnWalk}
)


class Pedestrians:
    """The people, in groups that have one behaviour and all see the robot or all do not."""

    def __init__(self, scenario: Scenario, seed: int):
        people = scenario.people
        self._radii = np.array([person.radius for person in people], float)
        self._groups: list[tuple[Index | slice, bool, Walk]] = []
        kinds = [(type(person.behaviour), person.sees) for person in people]
        for kind in dict.fromkeys(kinds):
            index = np.array([i for i, other in enumerate(kinds) if other == kind])
            first, last = int(index[0]), int(index[-1]) + 1
            together = last - first == len(index)  # a slice is written to in a third of the time
            place = slice(first, last) if together else index
            behaviour, sees = kind
            self._groups.append((place, sees, WALKS[behaviour](scenario, index, seed)))

    def velocities(self, world: WorldState) -> Array:
        """Desired velocities of all people, (P, 2) [m/s]."""
        desired = np.zeros((len(self._radii), 2))
        unseen = replace(world, robot_pose=np.full(3, np.nan), robot_twist=np.full(2, np.nan))
        for place, sees, walk in self._groups:
            desired[place] = walk.velocities(world if sees else unseen)
        return sidestepped(desired, world.people_position, self._radii)
