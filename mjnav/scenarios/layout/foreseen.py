"""Where people will be in the next seconds if nobody and nothing is in their way."""

from bisect import bisect_left
from itertools import pairwise

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.people import ConstantVelocity, Person, Replay, StopAndGo, Walker
from mjnav.scenarios.people.replay import Row
from mjnav.scenarios.ranges import Point

MAX_ROUNDS = 100  # of a loop that are foreseen


def foreseen(person: Person, times: Array) -> Array:
    """Where the person is at each of `times` [s], ascending: (T, 2) [m]; NaN while they are not there.

    Straight walkers go at their velocity, walkers along straight legs, recorded people straight from row to row of
    their track; people of behaviours of one's own stand. Who leaves at the end of a way is gone: where they come again
    is not foreseen.
    """
    enters = person.enters or 0.0
    there = (times >= enters) & (times < (np.inf if person.leaves is None else person.leaves))
    since = np.maximum(times - enters, 0.0)
    match person.behaviour:
        case Replay(track=track):
            where = _on_track(track, times)
        case ConstantVelocity(velocity=velocity):
            where = person.start + since[:, None] * velocity
        case StopAndGo(velocity=velocity, go_time=go, stop_time=stop):
            walked = _walking(np.maximum(times, enters), go, stop) - _walking(np.array([enters]), go, stop)
            where = person.start + walked[:, None] * velocity
        case Walker() as walk:
            where, left = _on_legs(person.start, walk, walk.speed * since)
            within = walk.leaves_within
            there &= np.full(len(times), True) if within is None else left > within
        case _:
            where = np.tile(person.start, (len(times), 1))
    return np.where(there[:, None], where, np.nan)


def _on_track(track: tuple[Row, ...], times: Array) -> Array:
    """(T, 2) [m] at `times` (T,) [s]."""
    rows = np.array(track[: bisect_left(track, times[-1], key=lambda row: row[0]) + 1])
    return np.stack([np.interp(times, rows[:, 0], rows[:, k]) for k in (1, 2)], axis=1)


def _walking(times: Array, go: float, stop: float) -> Array:
    """For how long of [0, time] who walks and stands in turns has walked, (T,) [s]."""
    rounds, rest = np.divmod(times, go + stop)
    return go * rounds + np.minimum(rest, go)


def _on_legs(start: Point, walk: Walker, walked: Array) -> tuple[Array, Array]:
    """After `walked` [m] (T,): where a walker is, (T, 2), and how far it still is to the last point, (T,) [m]."""
    points = [start, *walk.waypoints]
    if walk.loop and len(walk.waypoints) > 1:
        around = sum(np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise([*walk.waypoints, walk.waypoints[0]]))
        rounds = int(walked[-1] / around) + 1 if around > 0.0 else 0
        points += walk.waypoints * min(rounds, MAX_ROUNDS)
    corners = np.array(points, float)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])  # [m] of each corner
    where = np.stack([np.interp(walked, along, corners[:, k]) for k in (0, 1)], axis=1)
    return where, along[-1] - walked
