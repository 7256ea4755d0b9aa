"""All people of a scene, each with their behaviour."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from mjnav.geometry.kernel_types import Indices
from mjnav.messages import Array, WorldState
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.people import Replay
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import ConstantVelocity, Orca, Scenario, SocialForce, StopAndGo, Waypoints
from mjnav.world.engine import Engine
from mjnav.world.people.own import OwnWalk
from mjnav.world.people.presence import Presence, comes_or_goes
from mjnav.world.people.replay import Replayed
from mjnav.world.people.route import Route
from mjnav.world.people.sidestep import sidestepped
from mjnav.world.people.straight import Straight
from mjnav.world.people.temperament import Temperaments
from mjnav.world.people.walk import Walk


def _social_force(scenario: Scenario, index: Indices, seed: int) -> Walk:
    from mjnav.world.people.social_force import SocialForceWalk  # its kernels are loaded where such people are

    return SocialForceWalk(scenario, index, seed)


def _orca(scenario: Scenario, index: Indices, seed: int) -> Walk:
    from mjnav.world.people.orca import OrcaWalk  # its kernels are loaded where such people are

    return OrcaWalk(scenario, index, seed)


WALKS: Mapping[type, Callable[[Scenario, Indices, int], Walk]] = MappingProxyType(
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
        self._groups: list[tuple[Indices | slice, bool, Walk, Temperaments | None]] = []
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
        self._presence = Presence(scenario, seed) if comes_or_goes(scenario) else None

    @property
    def stranded(self) -> tuple[int, ...]:
        """Who were to come again and stay away for good, as none of the ways drawn for them can be walked."""
        return () if self._presence is None else self._presence.stranded

    def at_start(self, world: WorldState) -> tuple[WorldState, Array]:
        """The world without those who are not there from the beginning, and everybody's desired velocity, (P, 2)."""
        if self._presence is not None:
            world = _placed(world, dict.fromkeys(np.flatnonzero(~self._presence.present).tolist(), (np.nan, np.nan)))
        return world, self.velocities(world)

    def decide(self, world: WorldState, engine: Engine) -> None:
        """Lets people come and go, and tells the engine how all of them want to walk."""
        if self._presence is None:
            engine.walk(self.velocities(world))
            return
        arrived = np.zeros(len(self._radii), bool)
        for place, _, walk, _ in self._groups:
            arrived[place] = walk.arrived(world)
        leaving = self._presence.leaving(world, arrived)
        for person in leaving:
            engine.remove(person)
        world = _placed(world, dict.fromkeys(leaving, (np.nan, np.nan)))
        coming = self._presence.coming(world)
        for newcomer in coming:
            if newcomer.goal is not None:
                walk, place = self._walk_of(newcomer.person)
                walk.begin(place, newcomer.start, newcomer.goal)
        world = _placed(world, {newcomer.person: newcomer.start for newcomer in coming})
        desired = self.velocities(world)
        for newcomer in coming:
            engine.place(newcomer.person, newcomer.start, desired[newcomer.person])
        engine.walk(desired)

    def _walk_of(self, person: int) -> tuple[Walk, int]:
        """A person's walk, and the place in it."""
        for _, _, walk, _ in self._groups:
            if (found := np.flatnonzero(walk.index == person)).size:
                return walk, int(found[0])
        raise LookupError(f"person{person} has no walk")

    def velocities(self, world: WorldState) -> Array:
        """Desired velocities of all people, (P, 2) [m/s]; zero for those who are not there."""
        desired = np.zeros((len(self._radii), 2))
        unseen = world
        if not all(sees for _, sees, _, _ in self._groups):
            unseen = replace(world, robot_pose=np.full(3, np.nan), robot_twist=np.full(2, np.nan))
        for place, sees, walk, temperaments in self._groups:
            wanted = walk.velocities(world if sees else unseen)
            desired[place] = wanted if temperaments is None else temperaments.applied(world, wanted)
        if self._presence is not None:
            desired[~self._presence.present] = 0.0
        return sidestepped(desired, world.people_position, self._radii, self._straight)


def _placed(world: WorldState, places: Mapping[int, Point]) -> WorldState:
    """The world with some people at other places, at rest; NaN for who is not there."""
    if not places:
        return world
    position, velocity = world.people_position.copy(), world.people_velocity.copy()
    for person, place in places.items():
        position[person] = place
        velocity[person] = 0.0 * position[person]
    return replace(world, people_position=position, people_velocity=velocity)
