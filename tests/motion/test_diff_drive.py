import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.messages import RobotLimits
from mjnav.motion.unicycle import TRACK_WIDTH, WHEEL_RADIUS, ramp_mean, reachable, twist_of_wheels, wheel_speeds

SPEED, TURN = st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)
TWIST = st.tuples(SPEED, TURN)
LIMITS = RobotLimits(max_speed=1.2, min_speed=-0.3, max_turn_rate=2.0, max_acceleration=0.7, max_turn_acceleration=2.5)


@given(SPEED, TURN)
def test_wheel_speeds_turn_back_into_the_twist(v, omega):
    assert twist_of_wheels(*wheel_speeds(v, omega)) == pytest.approx((v, omega), abs=1e-12)


def test_wheels_turn_alike_straight_ahead_and_the_right_one_forward_to_the_left():
    assert wheel_speeds(0.5, 0.0) == pytest.approx((0.5 / WHEEL_RADIUS, 0.5 / WHEEL_RADIUS))
    left, right = wheel_speeds(0.0, 1.0)
    assert right == -left == pytest.approx(0.5 * TRACK_WIDTH / WHEEL_RADIUS)


@given(TWIST, st.floats(0.01, 1.0))
def test_what_is_reachable_lies_within_the_limits_and_the_acceleration(twist, duration):
    low, high = reachable(twist, LIMITS, duration)
    bounds = [(-0.3, 1.2, 0.7), (-2.0, 2.0, 2.5)]
    for i, (lower, upper, acceleration) in enumerate(bounds):
        u = min(max(twist[i], lower), upper)
        assert low[i] == pytest.approx(max(lower, u - acceleration * duration), abs=1e-15)
        assert high[i] == pytest.approx(min(upper, u + acceleration * duration), abs=1e-15)
        assert lower <= low[i] <= u <= high[i] <= upper


@settings(max_examples=40)
@given(TWIST, TWIST, st.floats(0.01, 1.0))
def test_the_ramps_mean_and_end_are_those_of_a_fine_simulation(before, command, duration):
    mean, end = ramp_mean(before, command, LIMITS, duration)
    steps = 500
    dt = duration / steps
    limit = np.array([LIMITS.max_acceleration, LIMITS.max_turn_acceleration])
    value, total = np.array(before, float), np.zeros(2)
    for _ in range(steps):
        following = value + np.clip(np.array(command) - value, -limit * dt, limit * dt)
        total += 0.5 * (value + following) * dt
        value = following
    assert end == pytest.approx(value, abs=1e-9)
    assert mean == pytest.approx(total / duration, abs=1e-3)


def test_a_command_within_reach_is_reached_exactly():
    mean, end = ramp_mean([0.0, 0.0], [0.05, 0.1], LIMITS, 0.1)
    assert end.tolist() == [0.05, 0.1]
    # 0.05 at 0.7 m/s^2 takes t = 1/14 s: the mean is 0.05 (1 - t / 2T)
    assert mean[0] == pytest.approx(0.05 * (1.0 - (0.05 / 0.7) / 0.2))


def test_a_command_out_of_reach_ends_after_the_acceleration_and_a_steady_one_stays():
    mean, end = ramp_mean([0.0, 1.0], [1.0, 1.0], LIMITS, 0.1)
    assert end == pytest.approx([0.07, 1.0])
    assert mean == pytest.approx([0.035, 1.0])
