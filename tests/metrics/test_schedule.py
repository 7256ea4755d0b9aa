"""What a schedule is worth: small ones, with exact answers. Periods of 10 ms."""

import numpy as np
import pytest

from mjnav.messages import PHASES
from mjnav.metrics.timing import (
    DEGRADED,
    FAIL,
    INCONCLUSIVE,
    PASS,
    Schedule,
    longest_overrun,
    verdict,
    wakeup_us,
)

US, MS = 1_000, 1_000_000  # [ns]
N = 1000


def schedule(
    ticks: int = N,
    *,
    lateness: dict[int, int] | None = None,
    overrun: dict[int, int] | None = None,
    took: dict[tuple[int, str], int] | None = None,
    rest: dict[int, int] | None = None,
    wall: float | None = None,
    **more,
) -> Schedule:
    """`ticks` ticks of 1 ms a phase in perfect time but for what is given, by tick and phase [ns]."""
    late, over = np.full(ticks, 2 * US), np.zeros(ticks, np.int64)
    phases = np.full((ticks, len(PHASES)), MS)
    for values, array in ((lateness, late), (overrun, over)):
        for tick, value in (values or {}).items():
            array[tick] = value
    for (tick, phase), value in (took or {}).items():
        phases[tick, PHASES.index(phase)] = value
    busy = phases.sum(axis=1) + 10 * US
    for tick, value in (rest or {}).items():
        busy[tick] += value
    return Schedule(0.01, 0.01 * ticks if wall is None else wall, late, over, phases, busy, **more)


# -------------------------------------------------------------------------------------------- verdict


def missing(num: int, ticks: int = N, **more) -> Schedule:
    return schedule(ticks, overrun={10 * tick: 3 * MS for tick in range(num)}, **more)


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        (schedule(), PASS),
        (schedule(300), PASS),
        (schedule(299), INCONCLUSIVE),
        (schedule(0), INCONCLUSIVE),
        (missing(20, 299), INCONCLUSIVE),
        (schedule(interrupted=True), INCONCLUSIVE),
        (missing(20, interrupted=True), INCONCLUSIVE),
        (schedule(stolen=0.5), PASS),  # whatever others took, it was in time
        (missing(1, stolen=0.011), INCONCLUSIVE),
        (missing(1, stolen=0.01), DEGRADED),
        (missing(20, stolen=0.011), INCONCLUSIVE),
        (missing(1), DEGRADED),
        (missing(10), DEGRADED),
        (missing(11), FAIL),
        (missing(1, skipped=1), FAIL),
        (schedule(log_dropped=1), DEGRADED),
        (missing(10, log_dropped=1), DEGRADED),
        (schedule(wall=10.01), PASS),  # 999.0 ticks in 10 s
        (schedule(wall=10.011), FAIL),
        (missing(1, wall=10.011), FAIL),
    ],
)
def test_the_verdict_is_that_of_the_first_rule_that_holds(found, expected):
    assert verdict(found) == expected


# -------------------------------------------------------------------------------------------- wake-up


def test_wake_up_leaves_out_the_first_tick_and_those_that_began_late_for_work():
    late = {tick: tick * US for tick in range(1002)}
    late[0] = 10**12
    late[501] = 10**12  # tick 500 was at work at its deadline
    found = wakeup_us(schedule(1002, lateness=late, overrun={500: 10**12, 1001: MS}))
    left = [float(tick) for tick in range(1, 1002) if tick != 501]
    quantiles = dict(zip(("p50", "p99", "p999"), np.quantile(left, [0.5, 0.99, 0.999]), strict=True))
    assert found == pytest.approx({**quantiles, "max": 1001.0})


# -------------------------------------------------------------------------------------------- overrun


def blamed(found: Schedule) -> tuple[int, str, float]:
    overrun = longest_overrun(found)
    assert overrun is not None
    return overrun.tick, overrun.phase, overrun.milliseconds


def test_without_a_missed_deadline_there_is_no_overrun():
    assert longest_overrun(schedule(took={(5, "control"): 9 * MS})) is None
    assert longest_overrun(schedule(0)) is None


@pytest.mark.parametrize("phase", PHASES)
def test_the_phase_that_took_unusually_long_is_to_blame(phase):
    took = {(tick, "estimate"): 3 * MS for tick in range(N)}  # as long in every tick
    found = schedule(took={**took, (77, phase): took.get((77, phase), 0) + 5 * MS}, overrun={77: 2 * MS + 500})
    assert blamed(found) == (77, phase, pytest.approx(2.0005))


def test_the_tick_that_began_the_delay_is_to_blame_for_where_it_led():
    took = {(50, "control"): 17 * MS, (51, "record"): 7 * MS, (40, "sense"): 20 * MS}
    overrun = {40: 14 * MS, 50: 11 * MS, 51: 17 * MS, 52: 12 * MS, 53: 7 * MS, 54: 2 * MS}
    lateness = {tick + 1: late for tick, late in overrun.items()}
    assert blamed(schedule(took=took, overrun=overrun, lateness=lateness)) == (50, "control", 17.0)


def test_a_late_wake_up_that_led_to_an_overrun_is_to_blame():
    found = schedule(lateness={300: 8 * MS, 301: 3 * MS}, overrun={300: 3 * MS}, took={(300, "sense"): 2 * MS})
    assert blamed(found) == (300, "wake-up", 3.0)


def test_a_schedule_that_was_never_in_time_has_someone_to_blame_too():
    took = {(2, "control"): 30 * MS}
    assert blamed(schedule(4, overrun=dict.fromkeys(range(4), 5 * MS), took=took))[0] == 0
    assert blamed(schedule(4, overrun={0: 5 * MS, 1: 6 * MS, 2: 31 * MS, 3: 30 * MS}, took=took)) == (
        2,
        "control",
        31.0,
    )
