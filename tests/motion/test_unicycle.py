import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.geometry.angles import wrap
from mjnav.messages import RobotLimits
from mjnav.motion.unicycle import Drive, integrate, integrate_rows, ramp_mean, reachable


def runge_kutta(pose, v, omega, duration, steps=200):
    """The unicycle's differential equation, fourth order."""

    def derivative(state):
        return np.array([v * np.cos(state[2]), v * np.sin(state[2]), omega])

    state, h = np.array(pose, float), duration / steps
    for _ in range(steps):
        k1 = derivative(state)
        k2 = derivative(state + 0.5 * h * k1)
        k3 = derivative(state + 0.5 * h * k2)
        k4 = derivative(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return state


@given(
    st.tuples(st.floats(-10, 10), st.floats(-10, 10), st.floats(-3.2, 3.2)),
    st.floats(-2.0, 2.0),
    st.one_of(st.floats(-3.0, 3.0), st.floats(-1e-6, 1e-6)),
    st.floats(0.0, 1.5),
)
def test_the_arc_solves_the_unicycles_equation(pose, v, omega, duration):
    exact, numerical = integrate(pose, v, omega, duration), runge_kutta(pose, v, omega, duration)
    assert exact[:2] == pytest.approx(numerical[:2], abs=1e-8)
    assert float(wrap(exact[2] - numerical[2])) == pytest.approx(0.0, abs=1e-9)
    assert -np.pi < exact[2] <= np.pi


SPEED, TURN = st.floats(-2.0, 2.0), st.floats(-3.0, 3.0)


@given(st.tuples(SPEED, SPEED, TURN), SPEED, TURN, st.floats(0.0, 1.5))
def test_one_pose_and_an_array_of_it_move_to_the_same_bits(pose, v, omega, duration):
    one, row = integrate(pose, v, omega, duration), integrate([pose], [v], [omega], duration)
    assert one.tobytes() == row.tobytes()


TWIST = st.tuples(SPEED, TURN)
LIMITS = RobotLimits(max_speed=1.2, min_speed=-0.3, max_turn_rate=2.0, max_acceleration=0.7, max_turn_acceleration=2.5)


@given(SPEED, TURN, st.floats(0.01, 0.3), st.floats(0.05, 1.0))
def test_wheel_speeds_turn_back_into_the_twist(v, omega, radius, track):
    drive = Drive(radius, track)
    assert drive.twist(*drive.wheel_speeds(v, omega)) == pytest.approx((v, omega), abs=1e-12)
    left, right = drive.wheel_speeds(v, omega)
    assert radius * np.array([left, right]) == pytest.approx([v - 0.5 * track * omega, v + 0.5 * track * omega])


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


@given(st.integers(0, 10**6), st.sampled_from([1e-9, 1e-3, 0.1, 1.0, 30.0]), st.floats(0.001, 2.0))
def test_rows_move_as_the_arrays_do(seed, rate, duration):
    rng = np.random.default_rng(seed)
    pose, v, omega = rng.uniform(-3.1, 3.1, (20, 3)), rng.normal(size=20), rate * rng.normal(size=20)
    before = pose.copy()
    assert integrate_rows(pose, v, omega, duration) == pytest.approx(integrate(pose, v, omega, duration), abs=1e-12)
    assert np.array_equal(pose, before)


def test_headings_are_wrapped_and_standing_still_changes_nothing():
    pose = np.array([[1.0, 2.0, 3.1], [1.0, 2.0, -3.1], [1.0, 2.0, np.pi]])
    turned = integrate_rows(pose, np.zeros(3), np.array([1.0, -1.0, 0.0]), 0.1)
    assert turned[:, 2] == pytest.approx([3.2 - 2.0 * np.pi, 2.0 * np.pi - 3.2, np.pi])
    assert np.array_equal(integrate_rows(pose, np.zeros(3), np.zeros(3), 0.1), pose)
