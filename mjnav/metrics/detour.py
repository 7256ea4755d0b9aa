"""What the robot cost the people: their paths and times with it against those without it, under the same seed.

A person's path is compared up to the last of their waypoints that they reach in both runs, and their position at equal
times while they are there in both. A person who leaves or comes in again is compared until then: later trips start
where the robot is not, and differ for that reason.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, Trajectory
from mjnav.metrics.arrival import passings
from mjnav.scenarios.spec import Scenario


@dataclass(frozen=True, slots=True)
class Detour:
    """Means over people; None where nobody counts."""

    path_m: float | None = None  # length with the robot minus without it, to the last waypoint reached in both
    delay_s: float | None = None  # by which this waypoint is reached later with the robot
    displacement_m: float | None = None  # distance between the two positions at equal time, mean over time and people


def detour(trajectory: Trajectory, undisturbed: Array, scenario: Scenario) -> Detour:
    """Of a run against `undisturbed` (T + 1, P, 2), where the people are at the same times without the robot [m]."""
    paths, delays, displacements = [], [], []
    for i, person in enumerate(scenario.people):
        with_robot, without = _first_stay(trajectory.people_position[:, i]), _first_stay(undisturbed[:, i])
        apart = np.hypot(*(with_robot - without).T)
        displacements.append(apart[np.isfinite(apart)])
        reached, alone = passings(person, with_robot), passings(person, without)
        if common := min(len(reached), len(alone)):
            there, then = int(reached[common - 1]), int(alone[common - 1])
            delays.append(float(trajectory.time[there] - trajectory.time[then]))
            paths.append(_length(with_robot[: there + 1]) - _length(without[: then + 1]))
    return Detour(_mean(np.array(paths)), _mean(np.array(delays)), _mean(np.concatenate([np.zeros(0), *displacements])))


def _first_stay(position: Array) -> Array:
    """The positions (T + 1, 2) until the person first goes; NaN before they come and from then on."""
    there = np.isfinite(position[:, 0])
    gone = np.flatnonzero(there[:-1] & ~there[1:])
    if not gone.size:
        return position
    stay = position.copy()
    stay[gone[0] + 1 :] = np.nan
    return stay


def _length(position: Array) -> float:
    """Of a path through positions (n, 2), without what is not known."""
    return float(np.nansum(np.hypot(*np.diff(position, axis=0).T)))


def _mean(values: Array) -> float | None:
    return float(values.mean()) if values.size else None
