"""The cause of a missed deadline: the loop, the machine, or work that a process does only once.

A deadline was missed through the machine where the loop, had the machine not stood still, would have met it; through
first-time work (a kernel compiled or loaded, a module imported) where it would have met it without that. All else is
the loop's. What would have been is found by replaying the schedule with the time taken off.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import PHASES
from mjnav.metrics.schedule import CAUSES, Schedule, blamed, excess

LOOP, MACHINE, FIRST_TIME = "loop", "machine", "first-time work"
MAX_NAMED = 100  # misses that are named, the longest; all are counted


@dataclass(frozen=True, slots=True)
class Miss:
    """One deadline missed: by `tick`, for what happened in `phase` of tick `since`, because of `cause`."""

    tick: int
    since: int
    phase: str  # of CAUSES
    cause: str  # LOOP, MACHINE or FIRST_TIME
    milliseconds: float  # beyond the deadline


@dataclass(frozen=True, slots=True)
class Blame:
    """The misses of a schedule by cause, and the schedule as it would have been but for the machine."""

    own: Schedule
    counts: dict[str, int]
    misses: tuple[Miss, ...]  # the MAX_NAMED longest, by tick


def overlap(schedule: Schedule, began: NDArray[np.int64], intervals: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n, len(CAUSES)) how much of each phase of each tick lies in the intervals [ns].

    `began` (n,) is when each tick's work did, and `intervals` (m, 2) are begins and ends on the same clock, in any
    order, one within another or not.
    """
    if not intervals.size or not schedule.ticks:
        return np.zeros((schedule.ticks, len(CAUSES)), np.int64)
    took = schedule.took
    edges = np.cumsum(took, axis=1) + (began - began[0] - took[:, 0])[:, None]
    edges = np.column_stack([edges[:, 0] - took[:, 0], edges])
    merged = _merged(intervals - began[0])
    covered = np.concatenate([[0], np.cumsum(merged[:, 1] - merged[:, 0])])
    at = np.column_stack([covered[:-1], covered[1:]]).ravel()
    return np.diff(np.interp(edges, merged.ravel(), at), axis=1).round().astype(np.int64)


def with_stolen(schedule: Schedule, stood_still: NDArray[np.int64], stolen: NDArray[np.int64]) -> NDArray[np.int64]:
    """`stood_still` (n, len(CAUSES)), but where more was stolen from a tick (n,) [ns] than that, this in its place.

    When time was stolen is not known: it is assigned to the phase that took longest beyond its median.
    """
    found = stood_still.copy()
    more = np.flatnonzero(stolen > stood_still.sum(axis=1))
    phase = 1 + np.argmax(excess(schedule)[more, 1:], axis=1)
    found[more] = 0
    found[more, phase] = np.minimum(stolen[more], schedule.took[more, phase])
    return found


def without(schedule: Schedule, spent: NDArray[np.int64]) -> Schedule:
    """The schedule as the pacer would have kept it, had the ticks not `spent` (n, len(CAUSES)) [ns] of their phases.

    A tick that met its deadline in truth counts as having met it.
    """
    if not spent.any():
        return schedule
    s = schedule
    period = round(1e9 * s.period)
    took = np.maximum(s.took - spent, 0)
    work = took[:, 1:].sum(axis=1)
    lateness, overrun = np.zeros_like(s.lateness), np.zeros_like(s.overrun)
    deadline = free = skipped = 0
    for tick in range(s.ticks):
        begin = max(deadline + int(took[tick, 0]), free)
        free = begin + int(work[tick])
        lateness[tick], deadline = begin - deadline, deadline + period
        late = max(0, free - deadline)
        if late and s.overrun[tick]:
            overrun[tick] = late
        given_up = late // period if late // period > s.max_catch_up else 0
        skipped += given_up
        deadline += given_up * period
    wall = 1e-9 * max(deadline, free) if s.ticks else s.wall
    phases, rest = took[:, 1 : 1 + len(PHASES)], took[:, 1 + len(PHASES)]
    return replace(
        s, wall=wall, lateness=lateness, overrun=overrun, phases=phases, busy=phases.sum(axis=1) + rest, skipped=skipped
    )


def blame(schedule: Schedule, stood_still: NDArray[np.int64], first_time: NDArray[np.int64]) -> Blame:
    """Every miss with its cause.

    `stood_still` and `first_time` (n, len(CAUSES)) say how long the machine stood still and how long work took that is
    done once, in each phase of each tick [ns].
    """
    own = without(schedule, stood_still)
    steady = without(schedule, stood_still + first_time)
    cause = np.where(own.overrun == 0, MACHINE, np.where(steady.overrun == 0, FIRST_TIME, LOOP))
    missed = np.flatnonzero(schedule.overrun)
    counts = {name: int(np.count_nonzero(cause[missed] == name)) for name in (LOOP, MACHINE, FIRST_TIME)}
    longest = np.sort(missed[np.argsort(-schedule.overrun[missed], kind="stable")][:MAX_NAMED])
    seen_in = {LOOP: steady, MACHINE: schedule, FIRST_TIME: own}
    beyond = {name: excess(found) for name, found in seen_in.items()}
    misses = []
    for tick in longest.tolist():
        name = str(cause[tick])
        since, phase = blamed(seen_in[name], beyond[name], tick)
        misses.append(Miss(tick, since, phase, name, float(schedule.overrun[tick]) * 1e-6))
    return Blame(own, counts, tuple(misses))


def _merged(intervals: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 2) the same time in intervals that follow one another."""
    rows = intervals[np.argsort(intervals[:, 0], kind="stable")]
    ends = np.maximum.accumulate(rows[:, 1])
    first = np.concatenate([[True], rows[1:, 0] > ends[:-1]])
    last = np.concatenate([first[1:], [True]])
    return np.column_stack([rows[first, 0], ends[last]])
