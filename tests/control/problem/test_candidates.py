import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.control.parameters import WINDOWS, Parameters
from mjnav.control.problem.candidates import candidate_grid
from mjnav.control.problem.goal_cost import GoalCost
from mjnav.messages import RobotLimits

LIMITS = st.builds(
    RobotLimits,
    max_speed=st.floats(0.1, 3.0),
    min_speed=st.floats(-2.0, 0.05),
    max_turn_rate=st.floats(0.1, 3.0),
    max_acceleration=st.floats(0.05, 5.0),
    max_turn_acceleration=st.floats(0.05, 10.0),
)
TWIST = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))  # also outside the limits
NUMBER = st.integers(1, 6)


@given(TWIST, LIMITS, st.floats(0.01, 1.0), NUMBER, NUMBER, st.sampled_from(WINDOWS))
def test_no_candidate_is_outside_the_limits_or_beyond_the_acceleration(twist, limits, period, num_v, num_omega, window):
    c = candidate_grid(np.array(twist), limits, period, num_v, num_omega, window)
    assert c.v.shape == c.omega.shape == (num_v * num_omega + 2,)
    assert (limits.min_speed <= c.v).all()
    assert (c.v <= limits.max_speed).all()
    assert (np.abs(c.omega) <= limits.max_turn_rate).all()
    v = np.clip(twist[0], limits.min_speed, limits.max_speed)
    omega = np.clip(twist[1], -limits.max_turn_rate, limits.max_turn_rate)
    bounded = slice(None) if window == "reachable" else slice(-2, None)  # keep and brake always are within reach
    assert (np.abs(c.v - v)[bounded] <= limits.max_acceleration * period + 1e-12).all()
    assert (np.abs(c.omega - omega)[bounded] <= limits.max_turn_acceleration * period + 1e-12).all()


@given(TWIST, LIMITS, st.floats(0.01, 1.0), st.sampled_from(WINDOWS))
def test_keep_and_brake_come_last(twist, limits, period, window):
    c = candidate_grid(np.array(twist), limits, period, 3, 4, window)
    v = np.clip(twist[0], limits.min_speed, limits.max_speed)
    omega = np.clip(twist[1], -limits.max_turn_rate, limits.max_turn_rate)
    assert (c.v[-2], c.omega[-2]) == (v, omega)
    # As far towards standing still as one period allows.
    goal = max(0.0, limits.min_speed)
    assert c.v[-1] == pytest.approx(
        goal + np.sign(v - goal) * max(0.0, abs(v - goal) - limits.max_acceleration * period)
    )
    rest = np.sign(omega) * max(0.0, abs(omega) - limits.max_turn_acceleration * period)
    assert c.omega[-1] == pytest.approx(rest)


def test_the_grid_is_regular_and_has_its_ends():
    limits = RobotLimits(max_speed=1.0, max_turn_rate=1.5, max_acceleration=1.0, max_turn_acceleration=3.0)
    reachable = candidate_grid(np.array([0.5, 0.0]), limits, 0.1, 3, 4, "reachable")
    assert reachable.v[:12] == pytest.approx(np.repeat([0.4, 0.5, 0.6], 4))
    assert reachable.omega[:12] == pytest.approx(np.tile([-0.3, -0.1, 0.1, 0.3], 3))
    bounds = candidate_grid(np.array([0.5, 0.0]), limits, 0.1, 3, 4, "bounds")
    assert bounds.v[:12] == pytest.approx(np.repeat([0.0, 0.5, 1.0], 4))
    assert bounds.omega[:12] == pytest.approx(np.tile([-1.5, -0.5, 0.5, 1.5], 3))


def cost_of(v, omega, *, goal=(5.0, 0.0), twist=(0.5, 0.0), pose=(0.0, 0.0, 0.0), **parameters):
    controls = type("Controls", (), {"v": np.array([v]), "omega": np.array([omega])})
    p = Parameters(**parameters)
    cost = GoalCost.of(controls, pose[2], np.array(twist), RobotLimits(), 0.1, p)
    return float(cost(np.array(pose[:2]), np.array(goal))[0])


def test_the_goal_cost_is_the_sum_of_its_terms():
    assert cost_of(0.8, 0.0, twist=(0.8, 0.0)) == pytest.approx(0.0)
    assert cost_of(0.5, 0.0) == pytest.approx(0.3**2)  # too slow by 0.3 m/s
    assert cost_of(0.6, 0.0, speed_change_weight=1.0) == pytest.approx(0.2**2 + 1.0)  # 0.1 m/s, all of one period
    assert cost_of(0.0, 0.15, turn_change_weight=4.0, heading_weight=0.0, twist=(0.0, 0.0)) == pytest.approx(0.64 + 1.0)
    away = cost_of(0.0, 0.0, goal=(-5.0, 0.0), twist=(0.0, 0.0), heading_weight=0.3)
    assert away == pytest.approx(0.8**2 + 0.3)  # half a turn away


def test_the_desired_speed_is_not_more_than_the_robot_can_do():
    assert cost_of(1.0, 0.0, preferred_speed=2.0, twist=(1.0, 0.0)) == pytest.approx(0.0)


def test_the_desired_speed_falls_near_the_goal():
    assert cost_of(0.25, 0.0, goal=(0.5, 0.0), approach_time=2.0, twist=(0.25, 0.0)) == pytest.approx(0.0)
    assert cost_of(0.0, 0.0, goal=(0.0, 0.0), twist=(0.0, 0.0)) == 0.0  # at the goal; no division by its distance
