"""Stalls against a clock that only moves when it is told to: who is blamed, and that no state ever changes."""

import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from mjnav.log import open_log
from mjnav.log.write import sink as sink_module
from mjnav.log.write.writer import Recorder, Writer
from mjnav.loop.episode import Episode
from mjnav.loop.pacer import FreePacer, RealTimePacer
from mjnav.loop.realtime.rate_test import RateTest, rate_test
from mjnav.loop.realtime.stress import shuttling
from mjnav.robot.navigator import Navigator
from mjnav.world.simulator import Simulator

pytestmark = pytest.mark.xdist_group("real time")

MS = 1_000_000  # [ns]
RATE, TICKS = 10.0, 12  # periods of 100 ms

# What is called once a tick, and the phase in which it is.
CALLS = {
    "sense": (Simulator, "sense"),
    "estimate": (Navigator, "estimate"),
    "control": (Navigator, "decide"),
    "record": (Recorder, "write"),
    "advance": (Simulator, "advance"),
    "rest": (Recorder, "write_timing"),
}


@pytest.fixture
def stall(clock, monkeypatch):
    """Makes a phase take `long` [ms] more in some ticks, by the fake clock."""

    def install(phase: str, stalls: dict[int, float]) -> None:
        owner, name = CALLS[phase]
        inner, calls = getattr(owner, name), iter(range(10**6))

        def stalling(self, *arguments):
            clock.now += round(stalls.get(next(calls), 0.0) * MS)
            return inner(self, *arguments)

        monkeypatch.setattr(owner, name, stalling)

    return install


@pytest.fixture
def measure(room, clock, monkeypatch):
    """A rate test of TICKS ticks against the fake clock, which says that they take next to nothing."""

    def measure(**options) -> RateTest:
        scenario = shuttling(room("physics.engine=kinematic"), RATE, TICKS / RATE)
        pacer = RealTimePacer(1.0 / RATE, clock=clock, sleep=clock.sleep, **options)
        return rate_test(scenario, pacer=pacer, warmed_up=True)

    return measure


def about(milliseconds: float):
    return pytest.approx(milliseconds, abs=0.1)  # looks at the clock of 1 us


def report(found: RateTest) -> tuple:
    """Tick and phase to blame, overrun [ms], misses, periods skipped."""
    s: Any = found.summary
    blame = s["longest_overrun"] or {"tick": None, "phase": None}
    return blame["tick"], blame["phase"], s["longest_overrun_ms"], s["deadline_misses"], s["skipped_periods"]


# --------------------------------------------------------------------------------- who is to blame


@pytest.mark.parametrize("phase", CALLS)
def test_a_stall_is_blamed_on_its_tick_and_phase(measure, stall, phase):
    stall(phase, {5: 130.0})
    assert report(measure()) == (5, phase, about(30.0), 1, 0)


def test_the_overrun_of_a_stall_counts_the_periods_that_were_skipped_for_it(measure, stall):
    stall("control", {4: 1250.0})
    found = measure()
    assert report(found) == (4, "control", about(1150.0), 1, 11)
    assert found.schedule.lateness[5] / MS == about(50.0)
    assert found.summary["achieved_hz"] == pytest.approx(TICKS / (TICKS + 11) * RATE, rel=1e-3)
    assert found.summary["real_time_factor"] == pytest.approx(TICKS / (TICKS + 11), rel=1e-3)


def test_a_wake_up_that_comes_too_late_is_to_blame_itself(measure, clock, monkeypatch):
    sleeps, sleep = iter(range(10**6)), clock.sleep

    def sleeping(self, seconds):
        sleep(seconds)
        clock.now += 130 * MS * (next(sleeps) == 5)

    monkeypatch.setattr(type(clock), "sleep", sleeping)
    found = measure()  # sleep 5 is before tick 6
    assert report(found) == (6, "wake-up", about(30.0 - 0.3), 1, 0)  # the spin's reserve was not used
    assert found.summary["wakeup_us"]["max"] == pytest.approx(129_700.0, abs=100.0)


# -------------------------------------------------------------------------------- the end on request


# --------------------------------------------------------------------------- the states stay the same


@pytest.mark.parametrize("engine", ["mujoco", "kinematic"])
def test_every_policy_pace_log_and_thread_layout_ends_in_the_same_state(room, clock, slow_clock, tmp_path, engine):
    scenario = shuttling(room(f"physics.engine={engine}"), 20.0, 0.5)
    period = scenario.control.period
    paces = {
        "free": lambda: FreePacer(),
        "on time": lambda: RealTimePacer(period, clock=clock, sleep=clock.sleep),
        "on time, or abort": lambda: RealTimePacer(period, clock=clock, sleep=clock.sleep, policy="abort"),
        "late": lambda: RealTimePacer(period, clock=slow_clock, sleep=slow_clock.sleep),
        "late, without catching up": lambda: RealTimePacer(
            period, clock=slow_clock, sleep=slow_clock.sleep, max_catch_up=0
        ),
    }
    hashes = {}
    for pace, make in paces.items():  # logs are direct where free, and on a thread of their own elsewhere
        for log in (None, tmp_path / f"{pace}.mcap"):
            result = Episode(scenario, log=log, pacer=make()).run()
            assert result.summary["ticks"] == 10
            hashes[pace, log is not None] = result.summary["state_hash"]
        assert open_log(tmp_path / f"{pace}.mcap").result["state_hash"] == result.summary["state_hash"]
    late = Episode(scenario, pacer=paces["late"]()).run()
    assert late.summary["deadline_misses"] == 10
    with ThreadPoolExecutor(1) as pool:
        threaded = pool.submit(Episode(scenario, log=tmp_path / "t.mcap").run).result()
    hashes["in a thread"] = threaded.summary["state_hash"]
    assert len(set(hashes.values())) == 1, hashes


def test_a_log_that_drops_changes_no_state_and_says_so(room, clock, tmp_path, monkeypatch):
    scenario = shuttling(room("physics.engine=kinematic"), 20.0, 0.5)
    go_on, entered, add_message = threading.Event(), threading.Event(), Writer.add_message

    def blocking(self, *arguments):
        entered.set()
        go_on.wait()
        add_message(self, *arguments)

    def open_at_the_end(time: float) -> None:
        if time > 0.0:
            entered.wait()
        if time > 0.49:
            go_on.set()

    expected = Episode(scenario).run().summary["state_hash"]
    monkeypatch.setattr(Writer, "add_message", blocking)
    monkeypatch.setattr(sink_module, "QUEUE_SIZE", 4)
    pacer = RealTimePacer(scenario.control.period, clock=clock, sleep=clock.sleep)
    found = rate_test(scenario, pacer=pacer, warmed_up=True, log=tmp_path / "a.mcap", progress=open_at_the_end)
    dropped: Any = found.summary["log_dropped"]
    assert dropped >= 14  # of 20 parts: four in the queue, one or two with the thread
    assert found.summary["state_hash"] == expected
    log = open_log(tmp_path / "a.mcap")
    assert log.result["state_hash"] == expected
    texts = [message.value.message for message in log.messages("/events") if message.value.name == "log"]
    assert texts == [f"{found.summary['log_dropped']} parts of ticks are missing: the disk could not keep up"]


def test_the_wall_clock_a_load_and_their_absence_end_in_the_same_state(room):
    scenario = shuttling(room("physics.engine=kinematic"), 20.0, 0.25)
    found = rate_test(scenario, stressed=True)
    assert found.summary["load"] != "none"
    assert found.summary["state_hash"] == Episode(scenario).run().summary["state_hash"]
