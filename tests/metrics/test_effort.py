from dataclasses import replace

import numpy as np
import pytest

import mjnav
from mjnav.metrics import effort


def test_control_cost_of_two_commands_by_hand():
    command = np.array([[0.5, 0.0], [0.5, 1.0], [0.2, 1.0]])
    expected = (0.5**2 + 0.17**2 * 1.0**2 + 0.3**2) / 0.1
    assert effort.control_cost(command, 0.1) == pytest.approx(expected)


def test_control_cost_counts_from_rest_and_a_constant_command_once():
    assert effort.control_cost(np.tile([0.8, 0.0], (50, 1)), 0.1) == pytest.approx(6.4)
    assert effort.control_cost(np.zeros((0, 2)), 0.1) == 0.0


def test_a_narrower_robot_pays_less_for_turning(trajectory_through):
    """Burger's wheels are 0.16 m apart: the figure, and what a planner expects of it, go by that."""
    narrow = mjnav.load_scenario("crossing1", {"robot.model": "burger"})
    assert narrow.robot.limits.track_width == 0.16
    trajectory = trajectory_through([[0.0, 0.0], [0.05, 0.0], [0.1, 0.0]])
    trajectory = replace(trajectory, command=np.array([[0.0, 1.0], [0.0, 0.0]]))
    assert effort.command_cost(trajectory, narrow) == pytest.approx(2 * 0.08**2 / narrow.control.period)


def test_wheels_that_skid_cost_what_the_ground_sees(trajectory_through):
    """A Jackal's wheels differ 2.03 times as much as rolling asks for: the figure and a planner go by the 0.376 m."""
    skids = mjnav.load_scenario("crossing1", {"robot.model": "jackal"})
    assert skids.robot.limits.track_width == 0.376 < skids.robot.drive.track_width
    trajectory = trajectory_through([[0.0, 0.0], [0.05, 0.0], [0.1, 0.0]])
    trajectory = replace(trajectory, command=np.array([[0.0, 1.0], [0.0, 0.0]]))
    assert effort.command_cost(trajectory, skids) == pytest.approx(2 * 0.188**2 / skids.control.period)


def straight_run(trajectory_through, nominal):
    nominal = np.asarray(nominal, float)
    xy = [[0.05 * i, 0.0] for i in range(len(nominal) + 1)]
    return trajectory_through(xy, nominal=nominal)


def test_time_to_avoid_is_from_the_first_tick_that_leaves_to_the_last(trajectory_through, scenario_with):
    keep, leave = (0.5, 0.0), (0.5, 1.0)
    trajectory = straight_run(trajectory_through, [keep, keep, leave, keep, leave, leave, keep, keep])
    assert effort.time_to_avoid(trajectory, scenario_with()) == pytest.approx(0.4)


def test_the_turn_from_the_start_is_no_avoiding(trajectory_through, scenario_with):
    turn, keep, leave = (0.1, 1.5), (0.5, 0.0), (0.5, -1.0)
    trajectory = straight_run(trajectory_through, [turn, turn, keep, leave, keep])
    assert effort.time_to_avoid(trajectory, scenario_with()) == pytest.approx(0.1)
    assert effort.time_to_avoid(straight_run(trajectory_through, [turn, turn, keep]), scenario_with()) == 0.0


def test_small_corrections_keep_the_way(trajectory_through, scenario_with):
    trajectory = straight_run(trajectory_through, [(0.5, 0.1), (0.5, -0.3), (0.5, 0.2)])
    assert effort.time_to_avoid(trajectory, scenario_with()) == 0.0


def test_waypoints_are_made_for_in_their_order_up_to_the_last(trajectory_through, scenario_with):
    scenario = scenario_with(waypoints=((1.0, 0.0), (1.0, 5.0), (30.0, 5.0)))
    xy = [[0.0, 0.0], [1.0, 0.0], [1.0, 5.0], [2.0, 5.0], [30.0, 5.0], [30.0, 5.0], [30.1, 5.0]]
    trajectory = trajectory_through(xy, nominal=np.array([(0.5, 0.0)] * 6))
    assert effort.time_to_avoid(trajectory, scenario) == pytest.approx(0.1)  # below the second, which is to the left


def test_a_world_that_is_turned_and_moved_takes_as_long_to_avoid(trajectory_through, scenario_with):
    keep, stopped, leave = (0.5, 0.0), (0.0, 0.0), (0.5, 1.0)
    trajectory = straight_run(trajectory_through, [keep, stopped, keep, leave, stopped, leave, keep])
    for angle in (0.0, 0.7, 2.0, -2.5):
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])

        def moved(pose, turn=turn, angle=angle):
            return np.column_stack([pose[:, :2] @ turn + [30.0, -7.0], pose[:, 2] + angle])

        goal = tuple(float(c) for c in np.array([10.0, 0.0]) @ turn + [30.0, -7.0])
        scenario = scenario_with(start=(30.0, -7.0, angle), goal=goal)
        there = replace(trajectory, robot_pose=moved(trajectory.robot_pose), estimate=moved(trajectory.estimate))
        assert effort.time_to_avoid(there, scenario) == pytest.approx(0.3)


def test_ticks_without_a_nominal_control_neither_keep_nor_leave_the_way(trajectory_through, scenario_with):
    keep, leave = (0.5, 0.0), (0.5, 1.0)
    for nothing in ((np.nan, np.nan), (0.5, np.nan)):
        trajectory = straight_run(trajectory_through, [keep, leave, nothing, leave, nothing])
        assert effort.time_to_avoid(trajectory, scenario_with()) == pytest.approx(0.3)
        assert effort.time_to_avoid(straight_run(trajectory_through, [nothing, leave]), scenario_with()) == 0.0


def test_a_method_without_nominal_controls_has_no_time_to_avoid(trajectory_through, scenario_with):
    assert effort.time_to_avoid(trajectory_through([[0, 0], [1, 0]]), scenario_with()) is None


PERIOD = 0.1


def driven(trajectory_through, v, heading=None, omega=None):
    """A run with these true speeds and headings at its states."""
    rows = len(v)
    pose = np.column_stack([np.zeros((rows, 2)), np.zeros(rows) if heading is None else heading])
    twist = np.column_stack([v, np.zeros(rows) if omega is None else omega])
    return trajectory_through(np.zeros((rows, 2)), robot_pose=pose, robot_twist=twist)


def test_speed_acceleration_and_jerk_by_hand(trajectory_through):
    trajectory = driven(trajectory_through, [0.0, 0.1, 0.4, 0.4, 0.4])
    assert effort.extremes(effort.velocity(trajectory)) == pytest.approx((0.0, 0.26, 0.4))
    assert effort.extremes(effort.acceleration(trajectory)) == pytest.approx((0.0, 1.0, 3.0))
    assert effort.extremes(effort.jerk(trajectory)) == pytest.approx((0.0, 50.0 / 3.0, 30.0))


def test_turning_at_constant_speed_is_an_acceleration(trajectory_through):
    turn = 0.5  # [rad/s]
    trajectory = driven(trajectory_through, np.full(4, 0.8), heading=turn * PERIOD * np.arange(4))
    chord = 2.0 * 0.8 * np.sin(0.5 * turn * PERIOD) / PERIOD  # v omega, but for the angle between two ticks
    assert effort.extremes(effort.acceleration(trajectory)) == pytest.approx((chord,) * 3)


def test_stalled_is_slow_and_not_moving_is_slower_and_does_not_turn(trajectory_through):
    v, omega = [0.5, -0.05, 0.0, 0.0, 0.0005, 0.0], [0.0, 0.0, 0.5, 0.0, 0.005, 0.0]
    trajectory = driven(trajectory_through, v, omega=omega)
    assert effort.stalled_time(trajectory) == pytest.approx(0.4)  # the last state has no period after it
    assert effort.time_not_moving(trajectory) == pytest.approx(0.2)


def test_headings_change_by_the_shorter_way_in_both_directions(trajectory_through, scenario_with):
    trajectory = driven(trajectory_through, np.zeros(4), heading=[3.0, -3.0, 3.0, 2.5])
    assert effort.heading_change(trajectory, scenario_with()) == pytest.approx(2 * (2 * np.pi - 6.0) + 0.5)
