"""How soon the robot knows again where it is after it was put elsewhere.

After a kidnapping it has recovered from the first tick on at which its belief's mean is within NEAR of its true
position and within ALIGNED of its true heading, and stays so for STEADY, or to the next kidnapping or the run's end.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mjnav.messages import Trajectory
from mjnav.metrics.consistency import robot_error
from mjnav.metrics.stretches import stretches
from mjnav.scenarios.spec import Scenario

NEAR = 0.5  # [m]
ALIGNED = 0.3  # [rad]
STEADY = 1.0  # [s]


@dataclass(frozen=True, slots=True)
class Recoveries:
    """The kidnappings of a run that took place, and how long the robot needed after each [s]; None where it did not."""

    times: tuple[float | None, ...]

    @property
    def recovered(self) -> int:
        """After how many of them it knew again."""
        return sum(time is not None for time in self.times)

    @property
    def longest(self) -> float | None:
        """The longest time of those after which it knew again [s]; None without any."""
        return max((time for time in self.times if time is not None), default=None)


def recoveries(trajectory: Trajectory, scenario: Scenario) -> Recoveries | None:
    """Of each kidnapping; None in a run without any.

    The robot may be put down later than the run file says, where somebody stands there: the tick counts at which it is
    first seen elsewhere.
    """
    if scenario.faults is None or not scenario.faults.kidnappings:
        return None
    num = len(trajectory.estimate)
    begun = [_first_tick(trajectory, scenario, one.time) for one in scenario.faults.kidnappings]
    ends = [*(k for k in begun if k is not None and k < num), num]
    error = robot_error(trajectory)
    knows = (np.hypot(error[:, 0], error[:, 1]) <= NEAR) & (np.abs(error[:, 2]) <= ALIGNED)
    return Recoveries(tuple(_recovery(trajectory.time, knows, first, end) for first, end in pairwise(ends)))


def _recovery(time: np.ndarray, knows: np.ndarray, first: int, end: int) -> float | None:
    """Of a kidnapping that is first seen at tick `first`, in the ticks before `end`."""
    for start, stop in stretches(knows[first:end]):
        if first + stop == end or time[first + stop] - time[first + start] >= STEADY - 1e-9:
            return round(float(time[first + start] - time[first]), 9)
    return None


def _first_tick(trajectory: Trajectory, scenario: Scenario, due: float) -> int | None:
    """The first tick after a jump that was due at a time [s]; None where the run was over before."""
    time, place = trajectory.time, trajectory.robot_pose[:, :2]
    first = int(np.searchsorted(time, due - 1e-9))
    if first >= len(time):
        return None
    step = np.hypot(*np.diff(place[max(first - 1, 0) :], axis=0).T)
    reach = 2.0 * scenario.robot.max_speed * scenario.control.period
    jumps = np.flatnonzero(step > reach)
    return first if not len(jumps) or first == 0 else first + int(jumps[0])
