"""As recorded: a velocity that leads along the track until the next decision."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from mjnav.geometry.kernel_types import Indices
from mjnav.messages import Array, WorldState
from mjnav.scenarios.crowd.spline import TrackSplines
from mjnav.scenarios.people import MAX_WALKING_SPEED, PERIOD
from mjnav.scenarios.people.replay import Replay
from mjnav.scenarios.spec import Scenario
from mjnav.world.people.walk import Walk

# [s] in which people take the velocity that they want: 70 kg pushed with 400 N s/m in MuJoCo (models/pedestrian.xml).
LAG: Mapping[str, float] = MappingProxyType({"mujoco": 0.175, "kinematic": 0.0})
GAIN = 2.9  # [1/s] of the way back to the track: with that lag it swings with a damping of 0.7
CATCH_UP = 1.0  # [m/s] fastest way back to the track, beside the track's own speed


class Replayed(Walk):
    """v(t) = (p(s + PERIOD) - p(s)) / PERIOD + min(GAIN |e|, CATCH_UP) e/|e| with s = t + LAG, e = p(t) - position.

    p is the spline. Where velocities are obeyed at once, who is on the track stays on it exactly.
    """

    def __init__(self, scenario: Scenario, index: Indices, seed: int):
        super().__init__(scenario, index, seed)
        found = [scenario.people[i].behaviour for i in index]
        self._splines = TrackSplines([np.array(one.track) for one in found if isinstance(one, Replay)])
        self._lag = LAG[scenario.physics.engine]

    def velocities(self, world: WorldState) -> Array:
        """See `Walk`."""
        # NaN: who is not there
        back = GAIN * np.nan_to_num(self._splines.positions(world.time) - world.people_position[self.index])
        along = self._splines.velocities(world.time, PERIOD, self._lag)
        return _limited(along + _limited(back, CATCH_UP), MAX_WALKING_SPEED)


def _limited(velocity: Array, highest: float) -> Array:
    """Velocities (n, 2), none faster than `highest`."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return velocity * (highest / np.maximum(speed, highest))[:, None]
