"""From commands to the wheels' set-points: bounds, acceleration limits, then noise."""

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, exact
from mjnav.messages import Array
from mjnav.motion.unicycle import command_bounds
from mjnav.noise import NOISE_WINDOW
from mjnav.scene.spec import Scenario
from mjnav.world.draws import Draws


class Actuation:
    """The robot's base: its set-point moves towards the command by at most a dt in each step of dt.

    The wheels get that set-point plus the noise of the present window. The noise is not limited: it stands for the
    base's own errors. In published crowds the set-point moves once a step of theirs, at its beginning, by all that it
    may in it: the robots there change their speeds at once.
    """

    def __init__(self, scenario: Scenario, seed: int):
        limits, timestep = scenario.robot.limits, scenario.physics.timestep
        self._low, self._high = command_bounds(limits)
        crowd = scenario.published
        self._hold = 1 if crowd is None else round(crowd.rules.period / timestep)  # steps from one move to the next
        moved = timestep * self._hold
        self._change = np.array([limits.max_acceleration * moved, limits.max_turn_acceleration * moved])
        self._steps = 0
        self._set_point = np.zeros(2)  # v [m/s], omega [rad/s], without the noise
        channels = ("actuation.v", "actuation.omega")
        self._draws = Draws(scenario.noise, [(channel, "robot") for channel in channels], seed, NOISE_WINDOW)
        self._noise = np.zeros(2)

    def open_window(self) -> None:
        """Draws the noise for the window that begins now."""
        self._noise = self._draws.row()

    def twists(self, command: tuple[float, float], num_steps: int) -> Array:
        """Noisy set-points of the next `num_steps` steps under `command`, (n, 2)."""
        twists = np.empty((num_steps, 2))
        since = self._steps % self._hold
        _ramp(self._set_point, command, self._low, self._high, self._change, self._noise, since, self._hold, twists)
        self._steps += num_steps
        return twists


@exact
def _ramp(
    set_point: Vector,
    command: tuple[float, float],
    low: Vector,
    high: Vector,
    change: Vector,
    noise: Vector,
    since: int,
    hold: int,
    twists: Matrix,
):
    """Moves the set-point in place, one step a row of `twists`, which receives it with the noise.

    It moves in every `hold`-th step; the last time was `since` steps ago, modulo `hold`. Step by step, so that the bits
    do not depend on where a call ends.
    """
    for j in range(2):
        target = min(max(command[j], low[j]), high[j])
        value = set_point[j]
        for i in range(len(twists)):
            if (since + i) % hold:
                pass
            elif value < target:
                value = min(value + change[j], target)
            elif value > target:
                value = max(value - change[j], target)
            twists[i, j] = value + noise[j]
        set_point[j] = value
