"""People who avoid one another reciprocally."""

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.motion import orca
from mjnav.scenarios.people.avoiding import Orca
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.avoiding import AvoidingWalk
from mjnav.world.people.walk import PERIOD, Index


class OrcaWalk(AvoidingWalk):
    """Velocities of `motion.orca`, nearest to those along the routes; never faster than these."""

    sidesteps = False  # the law says how to pass, also when people touch

    def __init__(self, scenario: Scenario, index: Index, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        settings = [settings_of(behaviour) for behaviour in found if isinstance(behaviour, Orca)]
        self._groups = [
            (np.array([i for i, other in enumerate(settings) if other == one]), one) for one in dict.fromkeys(settings)
        ]

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        wanted, bodies = self.wanted(world), self.bodies(world)
        found = np.empty_like(wanted)
        for group, settings in self._groups:
            found[group] = orca.velocities(
                bodies.position,
                bodies.velocity,
                self._radius,
                self.index[group],
                wanted[group],
                np.maximum(self._speed[group], np.hypot(*wanted[group].T)),
                self._temperaments.avoids[group],
                bodies.robot,
                self._floor.discs,
                self._floor.boxes,
                settings,
            )
        return self.unsteady(found)


def settings_of(keys: Orca) -> orca.OrcaSettings:
    """What the run file says."""
    return orca.OrcaSettings(
        keys.time_horizon, keys.wall_horizon, keys.neighbour_distance, keys.max_neighbours, keys.robot_share, PERIOD
    )
