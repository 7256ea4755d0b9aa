"""All people of a scene, each with their behaviour."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.people import Replay
from mjnav.scenarios.spec import ConstantVelocity, Orca, Scenario, SocialForce, StopAndGo, Waypoints
from mjnav.world.people.own import OwnWalk
from mjnav.world.people.replay import Replayed
from mjnav.world.people.route import Route
from mjnav.world.people.sidestep import sidestepped
from mjnav.world.people.straight import Straight
from mjnav.world.people.temperament import Temperaments
from mjnav.world.people.walk import Index, Walk


def _social_force(scenario: Scenario, index: Index, seed: int) -> Walk:
    from mjnav.world.people.social_force import SocialForceWalk  # its kernels are loaded where such people are

    return SocialForceWalk(scenario, index, seed)


def _orca(scenario: Scenario, index: Index, seed: int) -> Walk:
    from mjnav.world.people.orca import OrcaWalk  # its kernels are loaded where such people are

    return OrcaWalk(scenario, index, seed)


WALKS: Mapping[type, Callable[[Scenario, Index, int], Walk]] = MappingProxyType(
    {
        ConstantVelocity: Straight,
        StopAndGo: Straight,
        Waypoints: Route,
        SocialForce: _social_force,
        Orca: _orca,
        Replay: Replayed,
        BehaviourPlugin: OwnWalk,
    }
)


class Pedestrians:
    """The people, in groups that have one behaviour and all see the robot or all do not."""

    def __init__(self, scenario: Scenario, seed: int):
        people = scenario.people
        self._radii = np.array([person.radius for person in people], float)
        self._groups: list[tuple[Index | slice, bool, Walk, Temperaments | None]] = []
        self._straight = np.zeros(len(people), bool)  # who do not go round whom they touch
        kinds = [(type(person.behaviour), person.sees) for person in people]
        for kind in dict.fromkeys(kinds):
            index = np.array([i for i, other in enumerate(kinds) if other == kind])
            first, last = int(index[0]), int(index[-1]) + 1
            together = last - first == len(index)  # a slice is written to in a third of the time
            place = slice(first, last) if together else index
            behaviour, sees = kind
            walk = WALKS[behaviour](scenario, index, seed)
            temperaments = None if walk.tempers or not sees else Temperaments(scenario, index)
            self._straight[place] = not walk.sidesteps
            self._groups.append((place, sees, walk, temperaments))

    def velocities(self, world: WorldState) -> Array:
        """Desired velocities of all people, (P, 2) [m/s]."""
        desired = np.zeros((len(self._radii), 2))
        unseen = replace(world, robot_pose=np.full(3, np.nan), robot_twist=np.full(2, np.nan))
        for place, sees, walk, temperaments in self._groups:
            wanted = walk.velocities(world if sees else unseen)
            desired[place] = wanted if temperaments is None else temperaments.applied(world, wanted)
        turned = sidestepped(desired, world.people_position, self._radii)
        turned[self._straight] = desired[self._straight]
        return turned
