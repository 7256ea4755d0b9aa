"""The rate test: the scenario that it makes of another, and what it reports."""

import json
from fractions import Fraction
from itertools import pairwise
from math import ceil, hypot

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mjnav import scene
from mjnav.errors import InputError, InvalidValue
from mjnav.log import open_log
from mjnav.log.write import sink as sink_module
from mjnav.loop.episode import Episode
from mjnav.loop.pacer import RealTimePacer
from mjnav.loop.realtime.rate_test import rate_test
from mjnav.loop.realtime.stress import shuttling
from mjnav.messages import PHASES

pytestmark = pytest.mark.xdist_group("real time")

SPACE = """
schema = 1
name = "space"
[robot]
start = [0.0, 0.0, 0.0]
goal = [3.0, 0.0]
[physics]
engine = "kinematic"
timestep = 4.761904761904762e-4  # 1 / 2100: of the sensors' rates that the tests ask for
"""


def space(*overrides: str):
    return scene.loads(SPACE, overrides)


# -------------------------------------------------------------------------------------- the time step


def longest_timestep(rate: int, sensor_rate: int) -> Fraction:
    """By trying: a period and the sensors' period are whole numbers of it, and it is no more than 2 ms."""
    steps = 1
    while Fraction(1, rate * steps) > Fraction(2, 1000) or Fraction(steps * rate, sensor_rate).denominator != 1:
        steps += 1
    return Fraction(1, rate * steps)


@given(rate=st.integers(1, 500), sensor_rate=st.sampled_from([10, 4, 25, 30, 7]))
@example(rate=7, sensor_rate=10)
@example(rate=30, sensor_rate=10)
@example(rate=45, sensor_rate=10)
@example(rate=499, sensor_rate=30)
def test_the_time_step_is_the_longest_that_divides_both_periods(rate, sensor_rate):
    scenario = shuttling(space(f"sensors.rate={sensor_rate}"), float(rate), 1.0)
    assert scenario.physics.timestep == pytest.approx(float(longest_timestep(rate, sensor_rate)), rel=1e-12)
    assert scenario.control.rate == rate


def test_a_rate_without_a_time_step_in_common_with_the_sensors_is_refused():
    with pytest.raises(InvalidValue, match=r"rate: found 33\.3333; allowed: .*sensors\.rate \(10 Hz\)"):
        shuttling(space(), 33.3333, 1.0)


# ------------------------------------------------------------------------------------------ the route


def least_time(scenario) -> float:
    """In which a point at top speed could pass within the tolerance of all points of the route in their order [s]."""
    robot = scenario.robot
    points = [robot.start[:2], *robot.route]
    lengths = [hypot(b[0] - a[0], b[1] - a[1]) - 2.0 * robot.goal_tolerance for a, b in pairwise(points)]
    return sum(max(0.0, length) for length in lengths) / robot.max_speed


@given(
    route=st.lists(st.tuples(st.floats(-9.0, 9.0), st.floats(-9.0, 9.0)), min_size=1, max_size=3),
    tolerance=st.floats(0.01, 1.0),
    speed=st.floats(0.8, 3.0),
    duration=st.floats(0.1, 300.0),
)
def test_the_route_is_longer_than_can_be_driven(route, tolerance, speed, duration):
    points = [list(point) for point in route]
    overrides = (f"robot.waypoints={points}", f"robot.goal_tolerance={tolerance}", f"robot.max_speed={speed}")
    original = scene.loads(SPACE.replace("goal = [3.0, 0.0]", ""), overrides)
    longest = max(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise([(0.0, 0.0), *route]))
    assume(longest >= 2.0 * tolerance + 0.2)
    num_trips = 2 * ceil(duration * speed / (2.0 * (longest - 2.0 * tolerance))) + 1
    assume(2 * len(route) * num_trips <= 1000)
    scenario = shuttling(original, 50.0, duration)
    assert least_time(scenario) > 2.0 * duration  # beliefs reach a point before the robot does
    there = list(route)
    back = [*reversed(route[:-1]), (0.0, 0.0)]
    assert list(scenario.robot.route[: 2 * len(route)]) == [*there, *back]
    assert scenario.robot.route[-1] == (0.0, 0.0)


def test_a_duration_of_too_many_points_is_refused_with_the_longest_possible():
    near = space("robot.goal=[1.0, 0.0]")  # 0.4 m to drive at 1 m/s, back and forth 249 times
    with pytest.raises(InvalidValue, match=r"duration: found 600\.0; allowed: at most 199 s on so short a way"):
        shuttling(near, 50.0, 600.0)
    assert len(shuttling(near, 50.0, 199.0).robot.route) <= 1000


def test_a_goal_too_near_is_refused_with_what_is_missing():
    loop = scene.loads(SPACE.replace("goal = [3.0, 0.0]", "waypoints = [[0.5, 0.0], [0.0, 0.0]]"))
    with pytest.raises(InvalidValue, match=r"robot\.waypoints: .*allowed: a way to drive"):
        shuttling(loop, 50.0, 1.0)
    near = space("robot.goal=[0.79, 0.0]")
    with pytest.raises(InvalidValue, match=r"robot\.goal: found \(0\.79, 0\.0\); allowed: a way to drive: 0\.8 m"):
        shuttling(near, 50.0, 1.0)
    assert shuttling(space("robot.goal=[0.81, 0.0]"), 50.0, 1.0).robot.goal is None


def test_the_robot_shuttles_for_the_whole_duration():
    result = Episode(shuttling(space("robot.goal=[2.0, 0.0]"), 10.0, 12.0)).run()
    assert (result.summary["outcome"], result.summary["ticks"]) == ("timeout", 120)
    x = result.trajectory.robot_pose[:, 0]
    there = int(np.argmax(x > 1.6))
    assert there > 0
    assert x[there:].min() < 0.4


def test_the_test_goes_on_whatever_the_robot_hits():
    pillar = "pillars=[{position=[1.5, 0.6], radius=0.5}]"
    scenario = shuttling(space(pillar, "control.sensing_range=0.01", "robot.goal=[3.0, 0.0]"), 10.0, 6.0)
    result = Episode(scenario).run()
    assert (result.summary["outcome"], result.summary["ticks"]) == ("timeout", 60)
    assert result.summary["collisions"]["pillar"] > 0


@pytest.mark.parametrize(
    ("rate", "duration", "message"),
    [
        (0.0, 1.0, "rate: found 0.0; allowed: a number from 0.1 to 1000 Hz"),
        (float("nan"), 1.0, "rate: found nan"),
        (1001.0, 1.0, "rate: found 1001.0"),
        (50.0, 0.0, "duration: found 0.0; allowed: a number > 0"),
        (50.0, float("inf"), "duration: found inf"),
    ],
)
def test_rates_and_durations_that_make_no_sense_are_refused(rate, duration, message):
    with pytest.raises(InvalidValue) as raised:
        shuttling(space(), rate, duration)
    assert str(raised.value).startswith(message)


# ----------------------------------------------------------------------------------------- the report

KEYS = """
    schema scene controller requested_hz achieved_hz real_time_factor ticks timestep_ms deadline_misses skipped_periods
    longest_overrun_ms longest_overrun lateness_us wakeup_us compute_ms page_faults log_dropped stolen scheduler memory
    affinity load load_average kernel cpus state_hash status misses_by_cause missed machine_gaps
"""


@pytest.fixture
def on_time(clock, monkeypatch):
    """A rate test against the fake clock, which says that every tick takes next to nothing.

    In truth the loop runs as fast as it can, and the log's thread gets no time to rest: so it may fall behind.
    """
    monkeypatch.setattr(sink_module, "QUEUE_SIZE", 10**6)

    def test(scenario, **options):
        pacer = RealTimePacer(scenario.control.period, clock=clock, sleep=clock.sleep)
        return rate_test(scenario, pacer=pacer, warmed_up=True, **options)

    return test


def test_a_schedule_that_is_kept_passes_with_exact_figures(on_time):
    found = on_time(shuttling(space(), 50.0, 6.0))
    summary = found.summary
    assert sorted(summary) == sorted(KEYS.split())
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert (summary["status"], summary["ticks"], summary["requested_hz"]) == ("PASS", 300, 50.0)
    assert (summary["deadline_misses"], summary["skipped_periods"], summary["log_dropped"]) == (0, 0, 0)
    assert (summary["longest_overrun_ms"], summary["longest_overrun"]) == (0.0, None)
    assert summary["achieved_hz"] == pytest.approx(50.0, rel=1e-4)
    assert summary["real_time_factor"] == pytest.approx(1.0, rel=1e-4)
    assert summary["timestep_ms"] == pytest.approx(2.0)
    assert 0.0 <= summary["wakeup_us"]["max"] < 10.0  # looks at the clock of 1 us
    assert list(summary["wakeup_us"]) == ["p50", "p99", "p999", "max"]
    assert list(summary["compute_ms"]) == ["sense", "estimate", "control", "record", "tick"]
    assert found.schedule.phases.shape == (300, len(PHASES))
    assert (found.schedule.busy >= found.schedule.phases.sum(axis=1)).all()


def test_an_interrupted_test_reports_what_was_done(on_time):
    asked = iter(range(1000))
    found = on_time(shuttling(space(), 50.0, 60.0), stop=lambda: next(asked) >= 400)
    assert (found.summary["status"], found.schedule.ticks, found.schedule.interrupted) == ("INCONCLUSIVE", 400, True)
    nothing = on_time(shuttling(space(), 50.0, 60.0), stop=lambda: True).summary
    assert (nothing["status"], nothing["ticks"], nothing["achieved_hz"]) == ("INCONCLUSIVE", 0, 0.0)
    assert nothing["wakeup_us"]["p50"] is nothing["page_faults"]["max"] is None
    assert json.loads(json.dumps(nothing, allow_nan=False)) == nothing


def test_everything_is_logged_where_it_is_told_or_nowhere(on_time, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    scenario = shuttling(space(), 50.0, 0.2)
    on_time(scenario)
    assert list((tmp_path / "temporary").iterdir()) == []
    found = on_time(scenario, log=tmp_path / "a.mcap")
    log = open_log(tmp_path / "a.mcap")
    assert log.complete
    assert log.topics["/tick"].messages == found.schedule.ticks == 10
    assert log.result["state_hash"] == found.summary["state_hash"]
    with pytest.raises(InputError, match="exists already"):
        on_time(scenario, log=tmp_path / "a.mcap")
