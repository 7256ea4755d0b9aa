"""Straight on, without or with pauses."""

import numpy as np

from mjnav.geometry.kernel_types import Indices
from mjnav.messages import Array, WorldState
from mjnav.scenarios.spec import ConstantVelocity, Scenario, StopAndGo
from mjnav.world.people.walk import Walk


class Straight(Walk):
    """Constant velocity, in turns with standing still: moving while time mod (go + stop) < go."""

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        behaviours = [behaviour for behaviour in found if isinstance(behaviour, ConstantVelocity | StopAndGo)]
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
