"""The rate test: the scenario that it makes of another, and what it reports."""

import json
from fractions import Fraction
from itertools import pairwise
from math import ceil, hypot

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from mjnav import scene
from mjnav.errors import InvalidValue
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


def test_the_test_goes_on_whatever_the_robot_hits():
    pillar = "pillars=[{position=[1.5, 0.6], radius=0.5}]"
    scenario = shuttling(space(pillar, "control.sensing_range=0.01", "robot.goal=[3.0, 0.0]"), 10.0, 6.0)
    result = Episode(scenario).run()
    assert (result.summary["outcome"], result.summary["ticks"]) == ("timeout", 60)
    assert result.summary["collisions"]["pillar"] > 0


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
