"""What was and will be commanded, as the robot knows it."""

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, RobotLimits
from mjnav.motion.diff_drive import ramp_mean

ROUNDING = 1e-9  # [s] below which two moments are the same


@dataclass(frozen=True, slots=True)
class Stretch:
    """A command in force from `start` to `end` [s], with the set-point at which it found the robot."""

    start: float
    end: float
    set_point: Array  # (2,)
    command: Array  # (2,)


class CommandHistory:
    """Commands in order of time: each is in force until the next one's start, a zero command before the first."""

    def __init__(self, limits: RobotLimits):
        self._limits = limits
        self._starts = [0.0]
        self._commands = [np.zeros(2)]
        self._set_points = [np.zeros(2)]  # at the start of each command

    def append(self, start: float, command: Array) -> None:
        """One more command (2,), in force from `start` [s] on; no command overtakes the one before it."""
        self._starts.append(max(start, self._starts[-1]))
        self._commands.append(command)

    def forget(self, before: float) -> None:
        """Drops the commands that are no longer in force at a moment [s]; earlier ones will not be asked for."""
        over = bisect_right(self._starts, before + ROUNDING) - 1
        if over > 0:
            self._set_point(over)
            del self._starts[:over], self._commands[:over], self._set_points[:over]

    def in_force(self, time: float) -> Array:
        """The command in force at a moment [s], (2,)."""
        return self._commands[bisect_right(self._starts, time + ROUNDING) - 1]

    def switches(self, start: float, end: float) -> list[tuple[float, Array]]:
        """The commands that take force between two moments [s], each with its offset from the first."""
        first = bisect_right(self._starts, start + ROUNDING)
        last = bisect_right(self._starts, end - ROUNDING)
        return [(self._starts[j] - start, self._commands[j]) for j in range(first, last)]

    def stretches(self, start: float, end: float) -> list[Stretch]:
        """The commands in force between two moments [s], in order."""
        found = []
        for j in range(bisect_right(self._starts, start + ROUNDING) - 1, len(self._starts)):
            if self._starts[j] >= end:
                break
            begin = max(start, self._starts[j])
            until = min(end, self._starts[j + 1]) if j + 1 < len(self._starts) else end
            if until - begin <= ROUNDING:
                continue
            before = self._set_point(j)
            if begin > self._starts[j] + ROUNDING:
                _, before = ramp_mean(before, self._commands[j], self._limits, begin - self._starts[j])
            found.append(Stretch(begin, until, before, self._commands[j]))
        return found

    def _set_point(self, index: int) -> Array:
        """The set-point when command `index` begins."""
        while len(self._set_points) <= index:
            j = len(self._set_points) - 1
            duration = self._starts[j + 1] - self._starts[j]
            end = self._set_points[j]
            if duration > ROUNDING:
                _, end = ramp_mean(end, self._commands[j], self._limits, duration)
            self._set_points.append(end)
        return self._set_points[index]
