"""The schedule of ticks against a clock that only moves when it is told to."""

from dataclasses import dataclass

import pytest

from mjnav.loop.pacer import SPIN, FreePacer, RealTimePacer, Stopwatch

MS = 1_000_000  # [ns]
PERIOD = 100 * MS


LOOK = 1000  # [ns] that a look at the clock takes; a clock that stood still would be spun on for ever


@dataclass
class FakeClock:
    """Moves by what a look costs, by what is slept (and `oversleep`), and by what a test adds."""

    now: int = 5_000 * MS
    oversleep: int = 0

    def __call__(self) -> int:
        self.now += LOOK
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += round(seconds * 1e9) + self.oversleep


def about(time: int):
    return pytest.approx(time, abs=20 * LOOK)


def paced(clock: FakeClock, **options) -> RealTimePacer:
    return RealTimePacer(0.1, clock=clock, sleep=clock.sleep, **options)


def test_the_first_tick_begins_at_once_and_starts_the_schedule():
    clock = FakeClock()
    start = paced(clock).wait()
    assert (start.lateness, start.missed, clock.now) == (about(0), False, about(5_000 * MS))


def test_ticks_that_are_done_in_time_begin_at_whole_periods():
    clock = FakeClock()
    pacer = paced(clock)
    pacer.wait()
    began = clock.now
    for tick, work in enumerate((10 * MS, 99 * MS, 0, 50 * MS), start=1):
        clock.now += work
        start = pacer.wait()
        assert (start.lateness, start.missed) == (about(0), False)
        assert clock.now == about(began + tick * PERIOD)
    assert pacer.skipped == 0


def test_the_last_stretch_before_a_deadline_is_spun_and_not_slept():
    clock = FakeClock(oversleep=SPIN // 2)
    pacer = paced(clock)
    pacer.wait()
    assert pacer.wait().lateness == about(0)
    clock.oversleep = SPIN + 700_000  # a sleep that outlasts the reserve makes a tick late, but not missed
    start = pacer.wait()
    assert (start.lateness, start.missed) == (about(700_000), False)


def test_a_tick_whose_work_passes_the_deadline_is_missed_and_late_by_the_rest():
    clock = FakeClock()
    pacer = paced(clock)
    pacer.wait()
    clock.now += 130 * MS
    start = pacer.wait()
    assert (start.lateness, start.missed) == (about(30 * MS), True)


def test_lateness_within_the_bound_is_caught_up_with():
    clock = FakeClock()
    pacer = paced(clock, max_catch_up=3)
    pacer.wait()
    began = clock.now
    clock.now += 430 * MS  # the tick due at 100 begins 330 late: three whole periods behind
    late = [pacer.wait() for _ in range(5)]
    assert [start.lateness for start in late] == [about(t * MS) for t in (330, 230, 130, 30, 0)]
    assert [start.missed for start in late] == [True, True, True, True, False]
    assert clock.now == about(began + 5 * PERIOD)
    assert pacer.skipped == 0


def test_beyond_the_bound_whole_periods_are_skipped_and_the_phase_is_kept():
    clock = FakeClock()
    pacer = paced(clock, max_catch_up=3)
    pacer.wait()
    began = clock.now
    clock.now += 570 * MS  # 470 late: four whole periods behind
    start = pacer.wait()
    assert (start.lateness, start.missed, pacer.skipped) == (about(70 * MS), True, 4)
    start = pacer.wait()
    assert (start.lateness, start.missed) == (about(0), False)
    assert clock.now == about(began + 6 * PERIOD)


def test_a_bound_of_zero_never_makes_up_for_anything():
    clock = FakeClock()
    pacer = paced(clock, max_catch_up=0)
    pacer.wait()
    clock.now += 210 * MS
    assert pacer.wait().lateness == about(10 * MS)
    assert pacer.skipped == 1


def test_the_free_pacer_neither_waits_nor_is_ever_late():
    clock = FakeClock()
    pacer = FreePacer(clock)
    clock.now += 990 * MS
    start = pacer.wait()
    assert (start.lateness, start.missed, clock.now) == (0, False, 5_990 * MS)


def test_a_stopwatch_gives_each_phase_its_own_time_and_starts_afresh():
    clock = FakeClock()
    watch = Stopwatch(clock)
    taken = []
    for works in ((3, 5, 7), (11,)):
        watch.start()
        for work in works:
            clock.now += work
            watch.lap()
        taken.append([phase - LOOK for phase in watch.phases])
    assert taken == [[3, 5, 7], [11]]
