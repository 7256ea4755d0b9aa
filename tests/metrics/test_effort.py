from dataclasses import replace

import numpy as np
import pytest

from mjnav.metrics import effort


def test_control_cost_of_two_commands_by_hand():
    command = np.array([[0.5, 0.0], [0.5, 1.0], [0.2, 1.0]])
    expected = (0.5**2 + 0.17**2 * 1.0**2 + 0.3**2) / 0.1
    assert effort.control_cost(command, 0.1) == pytest.approx(expected)


def test_control_cost_counts_from_rest_and_a_constant_command_once():
    assert effort.control_cost(np.tile([0.8, 0.0], (50, 1)), 0.1) == pytest.approx(6.4)
    assert effort.control_cost(np.zeros((0, 2)), 0.1) == 0.0


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


def test_a_stopped_nominal_control_that_faces_the_goal_keeps_the_way(trajectory_through, scenario_with):
    trajectory = straight_run(trajectory_through, [(0.5, 0.0), (0.0, 0.0), (0.5, 0.0)])
    assert effort.time_to_avoid(trajectory, scenario_with()) == 0.0


def test_small_corrections_keep_the_way(trajectory_through, scenario_with):
    trajectory = straight_run(trajectory_through, [(0.5, 0.1), (0.5, -0.3), (0.5, 0.2)])
    assert effort.time_to_avoid(trajectory, scenario_with()) == 0.0


def test_the_way_leads_to_the_next_waypoint_once_one_was_reached(trajectory_through, scenario_with):
    scenario = scenario_with(waypoints=((1.0, 0.0), (1.0, 5.0)))
    xy = [[0.0, 0.0], [0.5, 0.0], [0.9, 0.0], [1.0, 0.0], [1.0, 0.2]]
    trajectory = trajectory_through(xy, nominal=np.array([(0.5, 0.0)] * 4))
    # from the third tick on the goal is to the left and straight on leads away
    assert effort.time_to_avoid(trajectory, scenario) == pytest.approx(0.2)


def test_waypoints_are_made_for_in_their_order_up_to_the_last(trajectory_through, scenario_with):
    scenario = scenario_with(waypoints=((1.0, 0.0), (1.0, 5.0), (30.0, 5.0)))
    xy = [[0.0, 0.0], [1.0, 0.0], [1.0, 5.0], [2.0, 5.0], [30.0, 5.0], [30.0, 5.0], [30.1, 5.0]]
    trajectory = trajectory_through(xy, nominal=np.array([(0.5, 0.0)] * 6))
    assert effort.time_to_avoid(trajectory, scenario) == pytest.approx(0.1)  # below the second, which is to the left


def test_where_the_way_leads_is_seen_from_where_the_robot_is(trajectory_through, scenario_with):
    # The goal is at (10, 0): nearly ahead from far off, 45 degrees to the right from beside it.
    trajectory = trajectory_through([[0.0, 1.0], [9.0, 1.0], [9.05, 1.0]], nominal=np.array([(0.5, 0.0)] * 2))
    assert effort.time_to_avoid(trajectory, scenario_with()) == pytest.approx(0.1)


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
