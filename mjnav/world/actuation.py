"""From commands to the wheels' set-points: bounds, acceleration limits, then noise."""

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.spec import Scenario
from mjnav.world.draws import Draws

NOISE_WINDOW = 0.1  # [s] for which a draw of the actuation noise holds, whatever the control rate


class Actuation:
    """The robot's base: its set-point moves towards the command by at most a dt in each step of dt.

    What the wheels get is that set-point plus the noise of the present window. The noise is not limited: it stands for
    what the base does of its own.
    """

    def __init__(self, scenario: Scenario, seed: int):
        limits, timestep = scenario.robot.limits, scenario.physics.timestep
        # A base may always stop, even one whose planner has a minimum speed.
        self._low = (min(limits.min_speed, 0.0), -limits.max_turn_rate)
        self._high = (max(limits.max_speed, 0.0), limits.max_turn_rate)
        self._change = (limits.max_acceleration * timestep, limits.max_turn_acceleration * timestep)
        self._set_point = [0.0, 0.0]
        channels = ("actuation.v", "actuation.omega")
        self._draws = Draws(scenario.noise.distributions(), [(channel, "robot") for channel in channels], seed)
        self._noise = np.zeros(2)

    @property
    def set_point(self) -> tuple[float, float]:
        """v [m/s] and omega [rad/s] without the noise."""
        return self._set_point[0], self._set_point[1]

    def open_window(self) -> None:
        """Draws the noise for the window that begins now."""
        self._noise = self._draws.row()

    def twists(self, command: tuple[float, float], num_steps: int) -> Array:
        """Noisy set-points of the next `num_steps` steps under `command`, (n, 2)."""
        twists = np.empty((num_steps, 2))
        for j in range(2):
            target = min(max(command[j], self._low[j]), self._high[j])
            value, change = self._set_point[j], self._change[j]
            if value == target:
                twists[:, j] = value
                continue
            # Step by step, so that the bits do not depend on where a call ends.
            column = np.full(num_steps + 1, change if value < target else -change)
            column[0] = value
            column = np.add.accumulate(column)[1:]
            twists[:, j] = np.minimum(column, target) if value < target else np.maximum(column, target)
            self._set_point[j] = float(twists[-1, j])
        twists += self._noise
        return twists
