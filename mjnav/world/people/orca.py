"""People who avoid one another reciprocally."""

import numpy as np

from mjnav.geometry.kernel_types import Indices
from mjnav.messages import Array, WorldState
from mjnav.motion import orca
from mjnav.scenarios.people import PERIOD
from mjnav.scenarios.people.avoiding import Orca
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.avoiding import AvoidingWalk, groups


class OrcaWalk(AvoidingWalk):
    """Velocities of `motion.orca`, nearest to those along the routes; never faster than these."""

    sidesteps = False  # the law says how to pass, also when people touch

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        settings = [settings_of(behaviour) for behaviour in found if isinstance(behaviour, Orca)]
        self._groups = groups(settings)

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        wanted, bodies = self.wanted(world), self.bodies(world)
        max_speed = np.maximum(self._speed, np.hypot(wanted[:, 0], wanted[:, 1]))
        found = np.empty_like(wanted)
        for group, settings in self._groups:
            found[group] = orca.velocities(
                bodies.position,
                bodies.velocity,
                self._radius,
                self.index[group],
                wanted[group],
                max_speed[group],
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
