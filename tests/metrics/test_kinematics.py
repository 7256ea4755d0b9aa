import numpy as np
import pytest

from mjnav.metrics import effort as kinematics

PERIOD = 0.1


def driven(trajectory_through, v, heading=None, omega=None):
    """A run with these true speeds and headings at its states."""
    rows = len(v)
    pose = np.column_stack([np.zeros((rows, 2)), np.zeros(rows) if heading is None else heading])
    twist = np.column_stack([v, np.zeros(rows) if omega is None else omega])
    return trajectory_through(np.zeros((rows, 2)), robot_pose=pose, robot_twist=twist)


def test_speed_acceleration_and_jerk_by_hand(trajectory_through):
    trajectory = driven(trajectory_through, [0.0, 0.1, 0.4, 0.4])
    assert kinematics.extremes(kinematics.velocity(trajectory)) == pytest.approx((0.0, 0.225, 0.4))
    assert kinematics.extremes(kinematics.acceleration(trajectory)) == pytest.approx((0.0, 4.0 / 3.0, 3.0))
    assert kinematics.extremes(kinematics.jerk(trajectory)) == pytest.approx((20.0, 25.0, 30.0))


def test_turning_at_constant_speed_is_an_acceleration(trajectory_through):
    turn = 0.5  # [rad/s]
    trajectory = driven(trajectory_through, np.full(4, 0.8), heading=turn * PERIOD * np.arange(4))
    chord = 2.0 * 0.8 * np.sin(0.5 * turn * PERIOD) / PERIOD  # v omega, but for the angle between two ticks
    assert kinematics.extremes(kinematics.acceleration(trajectory)) == pytest.approx((chord,) * 3)


def test_runs_too_short_for_a_difference_have_none(trajectory_through):
    one, two = driven(trajectory_through, [0.3]), driven(trajectory_through, [0.3, 0.3])
    assert kinematics.extremes(kinematics.acceleration(one)) == (None,) * 3
    assert kinematics.extremes(kinematics.jerk(one)) == (None,) * 3
    assert kinematics.extremes(kinematics.jerk(two)) == (None,) * 3


def test_stalled_is_slow_and_not_moving_is_slower_and_does_not_turn(trajectory_through):
    v, omega = [0.5, -0.05, 0.0, 0.0, 0.0005, 0.0], [0.0, 0.0, 0.5, 0.0, 0.005, 0.0]
    trajectory = driven(trajectory_through, v, omega=omega)
    assert kinematics.stalled_time(trajectory) == pytest.approx(0.4)  # the last state has no period after it
    assert kinematics.time_not_moving(trajectory) == pytest.approx(0.2)


def test_headings_change_by_the_shorter_way_in_both_directions(trajectory_through):
    trajectory = driven(trajectory_through, np.zeros(4), heading=[3.0, -3.0, 3.0, 2.5])
    assert kinematics.heading_change(trajectory) == pytest.approx(2 * (2 * np.pi - 6.0) + 0.5)
