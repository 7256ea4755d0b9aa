"""People who walk by a behaviour of a user's own."""

from collections.abc import Sequence
from math import hypot, isfinite
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import PluginFault
from mjnav.geometry.kernel_types import Indices
from mjnav.messages import Array, WorldState
from mjnav.plugins import BehaviourPlugin
from mjnav.rng import stream
from mjnav.scenarios.people import MAX_WALKING_SPEED
from mjnav.scenarios.spec import Scenario
from mjnav.sealed import sealed_message
from mjnav.world.people.walk import Walk


class Behaviour(Protocol):
    """How one person walks: made as Class(scenario, person, rng, parameters) for each person who has it.

    `person` is the person's place in `scenario.people` and in the arrays of a WorldState, `rng` a generator of its own
    that follows from the run's seed: who draws from no other walks the same way under the same seed.
    """

    def velocity(self, world: WorldState) -> ArrayLike:
        """The desired velocity (vx, vy) [m/s], at most 5 m/s; asked every 0.02 s of simulated time.

        `world` is the truth, whose arrays cannot be written to. The robot's pose and twist are NaN for a person with
        `sees_robot = false`, and people who are not there have NaN; they are not asked. Walls and bodies stop who walks
        into them.
        """
        ...


class OwnWalk(Walk):
    """The desired velocities of the people who have behaviours of a user's own."""

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        self._walks: list[tuple[str, Any]] = [_made(scenario, int(i), seed) for i in index]

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`. Raises PluginFault for what is no velocity."""
        world = sealed_message(world)
        found = np.zeros((len(self._walks), 2))
        for i, (name, walk) in enumerate(self._walks):
            if not np.isnan(world.people_position[self.index[i], 0]):
                with PluginFault.told(name, "velocity()"):
                    found[i] = _checked(name, walk.velocity(world))
        return found


def _made(scenario: Scenario, person: int, seed: int) -> tuple[str, Any]:
    behaviour = scenario.people[person].behaviour
    assert isinstance(behaviour, BehaviourPlugin)
    return behaviour.name, behaviour.make(scenario, person, stream(seed, "behaviour", f"person{person}"))


def _checked(name: str, velocity: Any) -> Sequence[float]:
    found = np.array(velocity, float)
    if found.shape != (2,):
        raise PluginFault(f"{name}: velocity() returned shape {found.shape} in place of (vx, vy)")
    vx, vy = found.tolist()
    if not (isfinite(vx) and isfinite(vy) and hypot(vx, vy) <= MAX_WALKING_SPEED):
        raise PluginFault(f"{name}: velocity() returned ({vx}, {vy}), not at most {MAX_WALKING_SPEED:g} m/s")
    return vx, vy
