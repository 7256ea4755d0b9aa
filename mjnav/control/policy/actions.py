"""Actions of a learned policy as commands: numbers from -1 to 1, or SI units."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.messages import Array, RobotLimits
from mjnav.motion.diff_drive import command_bounds


class Actions:
    """Actions a in [-1, 1]² of a robot: v = low + (a + 1)/2 (high - low), and omega likewise.

    `low` and `high`, (2,), are the lowest and highest v [m/s] and omega [rad/s] that the base takes. An action beyond
    [-1, 1] is a command beyond the limits, which the loop clips and counts.
    """

    def __init__(self, limits: RobotLimits):
        self.low, self.high = command_bounds(limits)

    def command(self, action: ArrayLike) -> Array:
        """(v [m/s], omega [rad/s]) of a normalised action (2,)."""
        return self.low + 0.5 * (np.asarray(action, float) + 1.0) * (self.high - self.low)

    def action(self, command: ArrayLike) -> Array:
        """The normalised action (2,) of (v [m/s], omega [rad/s]): the inverse of `command`."""
        return 2.0 * (np.asarray(command, float) - self.low) / (self.high - self.low) - 1.0
