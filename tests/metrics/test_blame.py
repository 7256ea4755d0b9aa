"""Whose fault a missed deadline is: small schedules with exact answers, and any schedule against the pacer itself."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mjnav.messages import PHASES
from mjnav.metrics.timing import (
    CAUSES,
    DEGRADED,
    FAIL,
    FIRST_TIME,
    LOOP,
    MACHINE,
    PASS,
    Schedule,
    blame,
    overlap,
    verdict,
    with_stolen,
    without,
)

MS = 1_000_000  # [ns]
PERIOD, MAX_CATCH_UP = 10 * MS, 3
N = 400


def paced(took) -> tuple[Schedule, np.ndarray]:
    """The schedule of a pacer whose ticks take that long, (n, len(CAUSES)) [ns], and when the ticks began.

    A second implementation: each tick by the words of `RealTimePacer`, on absolute times. A wake-up only takes long
    where the tick had something to wait for.
    """
    began, lateness, overrun, skipped = [], [], [], 0
    deadline = now = 5_000 * MS
    waits = True
    for row in took:
        if waits:
            now = deadline + int(row[0])
        began.append(now)
        lateness.append(now - deadline)
        now += int(row[1:].sum())
        deadline += PERIOD
        overrun.append(max(0, now - deadline))
        given_up = (now - deadline) // PERIOD
        if given_up > MAX_CATCH_UP:
            skipped += given_up
            deadline += given_up * PERIOD
        waits = overrun[-1] == 0
    phases = np.array(took)[:, 1 : 1 + len(PHASES)]
    busy = np.array(took)[:, 1:].sum(axis=1)
    wall = 1e-9 * (max(now, deadline) - began[0])
    found = Schedule(
        1e-9 * PERIOD, wall, np.array(lateness), np.array(overrun), phases, busy, skipped, max_catch_up=MAX_CATCH_UP
    )
    return found, np.array(began)


def usual(ticks: int = N) -> np.ndarray:
    """A tick takes 1 ms a phase, 5 ms in all."""
    took = np.zeros((ticks, len(CAUSES)), np.int64)
    took[:, 1 : 1 + len(PHASES)] = MS
    return took


def spent(stalls: dict[tuple[int, str], float], ticks: int = N) -> np.ndarray:
    """(n, len(CAUSES)) [ns] of stalls [ms] by tick and phase."""
    found = np.zeros((ticks, len(CAUSES)), np.int64)
    for (tick, phase), milliseconds in stalls.items():
        found[tick, CAUSES.index(phase)] = round(milliseconds * MS)
    return found


def named(machine=None, first_time=None, loop=None) -> tuple[dict[str, int], list[tuple]]:
    """Counts and names of the misses of a usual schedule with such stalls."""
    parts = [spent(part or {}) for part in (machine, first_time, loop)]
    found = blame(paced(usual() + sum(parts))[0], parts[0], parts[1])
    assert sum(found.counts.values()) == paced(usual() + sum(parts))[0].misses
    assert found.own.misses == found.counts[LOOP] + found.counts[FIRST_TIME]
    rows = [(miss.tick, miss.since, miss.phase, miss.cause, miss.milliseconds) for miss in found.misses]
    return {cause: count for cause, count in found.counts.items() if count}, rows


# ---------------------------------------------------------------------------------------- the causes


@pytest.mark.parametrize("phase", CAUSES)
def test_a_stall_is_its_causes_whichever_phase_it_hits(phase):
    for number, cause in enumerate((MACHINE, FIRST_TIME, LOOP)):
        stalls = [{}, {}, {}]
        stalls[number] = {(7, phase): 8.0}
        assert named(*stalls) == ({cause: 1}, [(7, 7, phase, cause, 3.0)])


def test_a_gap_that_does_not_explain_a_miss_leaves_it_to_the_loop():
    assert named(machine={(7, "sense"): 4.0}, loop={(7, "control"): 6.0}) == ({LOOP: 1}, [(7, 7, "control", LOOP, 5.0)])
    assert named(machine={(7, "sense"): 5.0}, loop={(7, "control"): 5.0}) == (
        {MACHINE: 1},
        [(7, 7, "sense", MACHINE, 5.0)],
    )
    assert named(machine={(8, "sense"): 4.0}, loop={(7, "control"): 6.0})[0] == {LOOP: 1}  # elsewhere


def test_the_misses_that_a_gap_leads_to_are_the_machines_and_name_it():
    counts, rows = named(machine={(4, "control"): 32.0})  # the ticks after it begin 27, 22, 17, 12, 7 and 2 ms late
    assert counts == {MACHINE: 6}
    assert rows == [(4 + k, 4, "control", MACHINE, 27.0 - 5.0 * k) for k in range(6)]


def test_a_slow_tick_amid_the_machines_misses_stays_the_loops():
    counts, rows = named(machine={(4, "control"): 32.0}, loop={(6, "record"): 8.0})
    assert counts == {MACHINE: 6, LOOP: 1}
    assert rows[2] == (6, 6, "record", LOOP, 25.0)


# ---------------------------------------------------------------------------------------- the verdict


@pytest.mark.parametrize(
    ("machine", "loop", "expected"),
    [
        ({}, {}, PASS),
        ({(7, "sense"): 8.0}, {}, PASS),
        ({(7, "sense"): 500.0, (200, "wake-up"): 300.0, (N - 1, "control"): 90.0}, {}, PASS),  # skipped, and at the end
        ({}, {(7, "sense"): 8.0}, DEGRADED),
        ({(9, "sense"): 500.0}, {(200, "sense"): 8.0}, DEGRADED),
        ({}, {(7, "sense"): 500.0}, FAIL),
        ({(9, "sense"): 8.0}, {(200, "sense"): 500.0}, FAIL),
    ],
)
def test_the_verdict_is_that_of_the_schedule_without_the_machines_gaps(machine, loop, expected):
    found = paced(usual() + spent(machine) + spent(loop))[0]
    assert verdict(blame(found, spent(machine), spent({})).own) == expected


milliseconds = st.floats(0.0, 60.0).map(lambda value: round(value * MS))
tables = st.lists(st.lists(milliseconds, min_size=len(CAUSES), max_size=len(CAUSES)), min_size=1, max_size=12)


@given(work=tables, gaps=st.dictionaries(st.integers(0, 10**6), milliseconds, max_size=3))
def test_a_schedule_without_its_gaps_is_what_the_pacer_would_have_kept(work, gaps):
    took = np.array(work) // len(CAUSES)
    took[:, 0] = 0  # a late wake-up is only seen where a tick had something to wait for
    stalls = np.zeros_like(took)
    for where, gap in gaps.items():
        stalls[where % len(took), 1 + where // len(took) % (len(CAUSES) - 1)] = gap
    expected, stalled = paced(took)[0], paced(took + stalls)[0]
    found = without(stalled, stalls)
    for name in ("lateness", "phases", "busy", "skipped"):
        assert np.array_equal(getattr(found, name), getattr(expected, name)), name
    assert found.wall == pytest.approx(expected.wall)
    assert found.overrun.tolist() == np.where(stalled.overrun > 0, expected.overrun, 0).tolist()
    counts = blame(stalled, stalls, np.zeros_like(stalls)).counts
    assert (counts[LOOP], counts[LOOP] + counts[MACHINE]) == (found.misses, stalled.misses)


# --------------------------------------------------------------------------------- intervals by phase


def by_hand(schedule: Schedule, began, intervals) -> np.ndarray:
    """Microsecond by microsecond."""
    found = np.zeros((schedule.ticks, len(CAUSES)), np.int64)
    for tick, row in enumerate(schedule.took // 1000):
        at = int(began[tick]) // 1000 - int(row[0])
        for phase, length in enumerate(row.tolist()):
            found[tick, phase] = sum(any(b <= t < e for b, e in intervals) for t in range(at, at + length))
            at += length
    return found * 1000


@given(
    took=st.lists(st.lists(st.integers(0, 30), min_size=7, max_size=7), min_size=1, max_size=4),
    intervals=st.lists(st.tuples(st.integers(0, 3), st.integers(-50, 300), st.integers(0, 120)), max_size=5),
)
@example(took=[[20] * 7] * 2, intervals=[(0, 0, 10), (0, 20, 30), (0, 30, 10), (1, -30, 40)])  # one within another
def test_the_overlap_with_any_intervals_is_that_of_every_microsecond(took, intervals):
    found, began = paced(np.array(took) * 1000)
    starts = [int(began[tick % len(took)]) // 1000 + begin for tick, begin, _ in intervals]
    pairs = [(start, start + length) for start, (_, _, length) in zip(starts, intervals, strict=True)]
    expected = by_hand(found, began, pairs)
    assert overlap(found, began, np.array(pairs, np.int64).reshape(-1, 2) * 1000).tolist() == expected.tolist()


def test_stolen_time_counts_once_in_the_phase_that_took_longest():
    stall = spent({(7, "control"): 8.0, (9, "sense"): 6.0, (13, "sense"): 1.0, (13, "record"): 1.0})
    found = paced(usual() + stall)[0]
    stolen = np.zeros(N, np.int64)
    stolen[[7, 9, 11, 13]] = 7 * MS, 2 * MS, 40 * MS, 2 * MS
    seen = spent({(9, "sense"): 6.0, (13, "sense"): 1.0, (13, "record"): 1.0})
    expected = seen + spent({(7, "control"): 7.0, (11, "sense"): 1.0})  # no more than the phase took
    assert with_stolen(found, seen, stolen).tolist() == expected.tolist()
