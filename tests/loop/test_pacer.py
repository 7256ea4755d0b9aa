"""The schedule of ticks against a clock that only moves when it is told to."""

import pytest

from mjnav.loop.pacer import BETWEEN, SPIN, RealTimePacer, Start, Stopwatch

MS = 1_000_000  # [ns]
PERIOD = 100 * MS
LOOK = 1000  # [ns] that a look at the fake clock takes


def about(time: int):
    return pytest.approx(time, abs=60 * LOOK)


def paced(clock, **options) -> RealTimePacer:
    return RealTimePacer(0.1, clock=clock, sleep=clock.sleep, **options)


def test_the_last_stretch_before_a_deadline_is_spun_and_not_slept(clock):
    clock.oversleep = SPIN // 2
    pacer = paced(clock)
    pacer.wait()
    assert pacer.wait().lateness == about(0)
    clock.oversleep = SPIN + 700_000  # a sleep that outlasts the reserve makes a tick late, but not missed
    start = pacer.wait()
    assert (start.lateness, start.missed) == (about(700_000), False)


# What each tick of 100 ms works [ms] -> how the next one begins: late [ms], missed, periods skipped; up to 3 caught up.
SCHEDULES = {
    "on time": ([10, 99, 0, 50], [(0, False, 0)] * 4),
    "late once": ([130, 20, 20], [(30, True, 0), (0, False, 0), (0, False, 0)]),
    "a little late again and again": ([110, 95, 110, 80], [(10, True, 0), (5, True, 0), (15, True, 0), (0, False, 0)]),
    "late beyond the bound": ([570, 10, 10], [(70, True, 4), (0, False, 0), (0, False, 0)]),
    "stalled": ([12_345, 40], [(45, True, 122), (0, False, 0)]),
    "stalled, then slow": ([12_345, 90, 90], [(45, True, 122), (35, True, 0), (25, True, 0)]),
    "overloaded": ([160] * 8, [(60 * n, True, 0) for n in range(1, 7)] + [(20, True, 4), (80, True, 0)]),
}


@pytest.mark.parametrize("name", SCHEDULES)
def test_schedules(clock, name):
    works, expected = SCHEDULES[name]
    pacer = paced(clock, max_catch_up=3)
    pacer.wait()
    began, phase = clock.now, 0
    for work, (late, missed, skipped) in zip(works, expected, strict=True):
        clock.now += work * MS
        start = pacer.wait()
        assert start == Start(about(late * MS), missed, skipped)
        phase += 1 + skipped
        assert clock.now == about(began + phase * PERIOD + late * MS)  # the schedule keeps its phase


def test_the_first_missed_deadline_asks_for_the_end_on_request(clock):
    pacer = paced(clock, policy="abort")
    pacer.wait()
    for work in (10, 99, 0):
        clock.now += work * MS
        assert pacer.wait() == Start(about(0), False)
    clock.now += 570 * MS
    before = clock.now
    assert pacer.wait() == Start(about(470 * MS), True, skipped=0, abort=True)
    assert clock.now == about(before)


def test_a_stopwatch_gives_each_phase_its_own_time_and_starts_afresh(clock):
    watch = Stopwatch(clock)
    taken = []
    for works in ({"truth": 3, "readings": 5, "decide": 7}, {"advance": 11}):
        watch.start()
        before = watch.spans
        for span, work in works.items():
            clock.now += work
            watch.lap(span)
        taken.append({span: time - LOOK for span, time in watch.spans.items()})
    assert taken == [{"truth": 3, "readings": 5, "decide": 7}, {"advance": 11}]
    assert watch.phases == (0, 0, 0, 0, 11 + LOOK)
    clock.now += 13
    watch.start()
    assert before[BETWEEN] == 13 + LOOK
