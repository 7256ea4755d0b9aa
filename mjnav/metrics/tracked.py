"""Who is to be tracked, and the tracks: two sets of points at each tick, which GOSPA and CLEAR MOT compare."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import ROWS
from mjnav.scenarios.spec import Scenario


@dataclass(frozen=True, slots=True)
class TrackedBlock:
    """Successive ticks, from tick `start` on. Points that are not there are NaN; so are all at ticks without a belief.

    A track of named people stands in the column of its person.
    """

    start: int
    people: Array  # (t, P, 2) [m] who are to be tracked
    tracks: Array  # (t, K, 2) [m]
    numbers: Array | None  # (t, K) of the tracks; None where the sensor names the people


def tracked_blocks(trajectory: Trajectory, scenario: Scenario) -> Iterator[TrackedBlock]:
    """All ticks with a belief, a block at a time.

    To be tracked is who is there, whether the robot can see them or not. Where people are tracked by the lidar, people
    and tracks count within its range of the robot's centre.
    """
    reach = scenario.sensors.scanner.max_range if scenario.estimation.obstacles.source == "lidar" else None
    named = not len(trajectory.track_states)
    for start in range(0, len(trajectory.status), ROWS):
        rows = slice(start, min(start + ROWS, len(trajectory.status)))
        robot = trajectory.robot_pose[rows, None, :2].copy()
        robot[np.isnan(trajectory.estimate[rows, 0])] = np.nan  # nothing is within reach of it
        people = trajectory.people_position[rows]
        tracks, numbers = (trajectory.tracks[rows, :, :2], None) if named else _numbered(trajectory, rows)
        yield TrackedBlock(start, _within(people, robot, reach), _within(tracks, robot, reach), numbers)


def _within(points: Array, robot: Array, reach: float | None) -> Array:
    """Points (t, n, 2) with NaN for those that are farther from the robot (t, 1, 2) than its reach."""
    distance = np.linalg.norm(points - robot, axis=-1, keepdims=True)
    return np.where(distance <= (np.inf if reach is None else reach), points, np.nan)


def _numbered(trajectory: Trajectory, rows: slice) -> tuple[Array, Array]:
    """The places (t, K, 2) and numbers (t, K) of the tracks that carry no name; K is the largest number at one tick."""
    states = trajectory.track_states
    first, last = np.searchsorted(states[:, 0], [rows.start, rows.stop])
    states = states[first:last]
    tick = states[:, 0].astype(np.intp) - rows.start
    count = np.bincount(tick, minlength=rows.stop - rows.start)
    column = np.arange(len(tick)) - (np.cumsum(count) - count)[tick]
    shape = len(count), int(count.max(initial=0))
    places, numbers = np.full((*shape, 2), np.nan), np.full(shape, np.nan)
    places[tick, column], numbers[tick, column] = states[:, 2:4], states[:, 1]
    return places, numbers
