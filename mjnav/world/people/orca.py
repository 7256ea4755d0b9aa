"""People who avoid one another reciprocally."""

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Flags, Indices, Matrix, Vector
from mjnav.messages import Array, WorldState
from mjnav.motion.orca import OrcaSettings, velocities
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
        avoids, discs, boxes = self._temperaments.avoids, self._floor.discs, self._floor.boxes
        for group, settings in self._groups:
            _avoid(
                found, group, wanted, max_speed, self.index, avoids,
                bodies.position, bodies.velocity, self._radius, bodies.robot, discs, boxes, settings,
            )  # fmt: skip
        return self.unsteady(found)


@exact
def _avoid(
    found: Matrix,
    group: Indices,
    wanted: Matrix,
    max_speed: Vector,
    index: Indices,
    avoids: Flags,
    position: Matrix,
    velocity: Matrix,
    radius: Vector,
    robot: int,
    discs: Matrix,
    boxes: Matrix,
    settings: OrcaSettings,
):
    """Writes the velocities of a `group` to theirs among `found` (n, 2).

    `wanted`, `max_speed`, `index` and `avoids` are of all n people, `position`, `velocity` and `radius` of all bodies.
    """
    found[group] = velocities(
        position, velocity, radius, index[group], wanted[group], max_speed[group], avoids[group], robot, discs, boxes,
        settings,
    )  # fmt: skip


def settings_of(keys: Orca) -> OrcaSettings:
    """What the run file says."""
    return OrcaSettings(
        keys.time_horizon, keys.wall_horizon, keys.neighbour_distance, keys.max_neighbours, keys.robot_share, PERIOD
    )
