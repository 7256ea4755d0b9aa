"""Where a robot can start and end, so that it crosses a recorded crowd."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import atan2, hypot

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.crowd.spline import TrackSplines
from mjnav.scenarios.crowd.tracks import Track

EDGE = 0.5  # [m] from the edges of the area in which people walk
CLEAR = 2.0  # [m] between centres at the start: nearer people cannot be avoided by a robot that stands
CLEAR_TIME = 2.0  # [s] for which the start is clear, and before the end for which the goal is
_PLACES = (0.5, 0.3, 0.7, 0.1, 0.9)  # along an edge, as shares of its length


@dataclass(frozen=True, slots=True)
class RobotWay:
    """A start, a goal and how far people keep from them."""

    start: tuple[float, float, float]  # x, y [m], heading [rad]
    goal: tuple[float, float]
    clearance: float  # [m] from the start's centre to the nearest person's in the first CLEAR_TIME


def robot_way(tracks: Sequence[Track], first: float, last: float) -> RobotWay:
    """A straight way across the area of the people of a window [s] whose start is clear.

    The one with the largest product of its length and of how clear its ends are, up to CLEAR. The goal is looked at
    towards the end.
    """
    rows = np.concatenate([_there(track, first, last) for track in tracks])
    low, high = rows.min(axis=0), rows.max(axis=0)
    inset = np.minimum(EDGE, 0.25 * (high - low))
    soon = _positions(tracks, first, min(first + CLEAR_TIME, last))
    late = _positions(tracks, max(last - CLEAR_TIME, first), last)

    def value(way: tuple[Array, Array]) -> float:
        start, goal = way
        return hypot(*(goal - start)) * min(_distance(soon, start), _distance(late, goal), CLEAR)

    start, goal = max(_ways(low + inset, high - inset), key=value)
    heading = atan2(goal[1] - start[1], goal[0] - start[0])
    x, y, to_x, to_y = (round(float(value), 2) for value in (*start, *goal))
    return RobotWay((x, y, round(heading, 4)), (to_x, to_y), _distance(soon, start))


def _ways(low: Array, high: Array) -> Iterator[tuple[Array, Array]]:
    """From each place on an edge straight to the opposite one, in both directions."""
    for axis in (0, 1):
        for share in _PLACES:
            start, goal = low.copy(), high.copy()
            start[1 - axis] = goal[1 - axis] = low[1 - axis] + share * (high - low)[1 - axis]
            yield start, goal
            yield goal, start


def _there(track: Track, first: float, last: float) -> Array:
    """Where a person is in a window, at its ends and at the rows within: (k, 2)."""
    time = track.rows[:, 0]
    times = np.concatenate([time[(time > first) & (time < last)], np.clip([first, last], time[0], time[-1])])
    return np.stack([np.interp(times, time, track.rows[:, i]) for i in (1, 2)], axis=1)


def _positions(tracks: Sequence[Track], first: float, last: float) -> Array:
    """Where people are between two times, every 0.1 s: (n, 2); who comes and goes counts all the time."""
    there = [track.rows for track in tracks if track.rows[0, 0] < last and track.rows[-1, 0] > first]
    if not there:
        return np.empty((0, 2))
    splines = TrackSplines(there)
    return np.concatenate([splines.positions(float(time)) for time in np.arange(first, last + 0.05, 0.1)])


def _distance(positions: Array, point: Array) -> float:
    return float(np.hypot(*(positions - point).T).min()) if len(positions) else float("inf")
