from dataclasses import replace

import numpy as np
import pytest

from mjnav.metrics import consistency, progress
from mjnav.metrics.progress import ROWS, by_blocks
from mjnav.scene.spec import Person, Waypoints
from tests.metrics.conftest import make_scenario, make_trajectory


def test_the_ratio_is_to_the_way_over_all_waypoints(trajectory_through, scenario_with):
    scenario = scenario_with(waypoints=((3.0, 0.0), (3.0, 4.0)))
    assert progress.length(progress.way(scenario)) == pytest.approx(7.0)
    trajectory = trajectory_through([[0, 0], [3, 0], [3, 4], [3, 7.5]])
    assert progress.path_ratio(trajectory, scenario) == pytest.approx(10.5 / 7.0)


def test_a_way_without_length_has_no_ratio(trajectory_through, scenario_with):
    scenario = scenario_with(goal=(0.0, 0.0))
    trajectory = trajectory_through([[0, 0], [1, 0]])
    assert progress.path_ratio(trajectory, scenario) is None
    assert progress.deviation(trajectory, scenario) == pytest.approx((0.5, 1.0))


@pytest.mark.parametrize("start", [0.0, 5.0])
def test_deviation_is_the_time_mean_and_the_maximum(trajectory_through, scenario_with, start):
    # a triangle of height 2 over two of four periods: (2 * 2 / 2) / 4
    route = [[0, 0], [1, 0], [2, -2], [3, 0], [4, 0]]
    trajectory = trajectory_through(route, time=start + 0.1 * np.arange(5))
    assert progress.deviation(trajectory, scenario_with()) == pytest.approx((0.5, 2.0))


def test_at_a_corner_the_nearest_leg_counts():
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]])
    points = np.array([[2.0, 1.0], [3.5, 2.0], [5.0, -1.0], [4.5, 6.0], [-1.0, 0.3]])
    expected = np.array([1.0, 0.5, np.sqrt(2), 0.5, 0.3])
    np.testing.assert_allclose(progress.lateral_distance(points, corners), expected)
    for scale in (0.1, 100.0):  # shorter than a metre, too
        np.testing.assert_allclose(progress.lateral_distance(scale * points, scale * corners), scale * expected)
    for angle in (0.7, 2.5, -1.9):
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        turned = progress.lateral_distance(points @ turn, corners @ turn)
        np.testing.assert_allclose(turned, expected)
    table = progress.lateral_distance(np.stack([points, points[::-1]]), corners)
    np.testing.assert_allclose(table, [expected, expected[::-1]])


def test_a_leg_of_no_length_changes_no_deviation():
    corners = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]])
    points = np.array([[-1.0, 0.5], [2.0, -1.0], [4.0, 2.0], [3.0, 0.25], [4.5, 9.0]])
    expected = progress.lateral_distance(points, corners)
    assert expected[[0, 4]].tolist() == [0.5, 0.5]  # behind the start, past the goal
    for legs in ([0, 0, 1, 2], [0, 1, 1, 2], [0, 1, 2, 2], [0, 0, 0, 1, 2, 2]):
        np.testing.assert_array_equal(progress.lateral_distance(points, corners[legs]), expected)
    np.testing.assert_allclose(progress.lateral_distance(points, corners[[0, 0, 0]]), np.hypot(*points.T))


def test_a_failure_to_progress_is_five_seconds_without_ten_centimetres_and_counts_once(
    trajectory_through, scenario_with
):
    scenario = scenario_with(goal=(10.0, 0.0))
    drive = np.linspace(0.0, 2.0, 20)
    rest = np.full(120, 2.0)  # 12 s
    creep = 2.0 + 0.0015 * np.arange(80)  # 0.12 m in 8 s: nearer by 0.1 m after 6.7 s
    x = np.concatenate([drive, rest, np.linspace(2.0, 4.0, 20), np.linspace(4.0, 3.0, 60)])
    for route, expected in ((drive, 0), (np.r_[drive, rest[:49]], 0), (np.r_[drive, rest], 1), (creep, 1), (x, 2)):
        trajectory = trajectory_through(np.column_stack([route, np.zeros(len(route))]))
        assert progress.failures_to_progress(trajectory, scenario) == expected


def test_progress_is_along_the_route(trajectory_through, scenario_with):
    scenario = scenario_with(waypoints=((3.0, 0.0), (0.0, 0.0)))  # there and back: the goal is where it began
    x = np.concatenate([np.linspace(0.0, 3.0, 80), np.linspace(3.0, 0.3, 80)])
    assert progress.failures_to_progress(trajectory_through(np.column_stack([x, np.zeros(160)])), scenario) == 0


def test_behind_each_point_lie_the_legs_that_are_left(scenario_with):
    scenario = scenario_with(waypoints=((3.0, 0.0), (3.0, 4.0)))
    assert progress.legs_behind(scenario).tolist() == [4.0, 0.0]


@pytest.mark.parametrize(
    ("route", "success", "expected"),
    [
        ([[0, 0], [10, 0]], True, 1.0),
        ([[0, 0], [9.7, 0]], True, 1.0),  # within the goal's tolerance
        ([[0, 0], [10, 0], [10, 10]], True, 0.5),
        ([[0, 0], [10, 0]], False, 0.0),
    ],
)
def test_success_weighted_by_path_length(trajectory_through, scenario_with, route, success, expected):
    assert progress.spl(trajectory_through(route), scenario_with(), success=success) == expected


def test_a_goal_where_the_robot_starts_has_no_weighted_success(trajectory_through, scenario_with):
    assert progress.spl(trajectory_through([[0, 0]]), scenario_with(goal=(0.0, 0.0)), success=True) is None


def walker(*waypoints, loop=False):
    return Person((0.0, 0.0), Waypoints(waypoints, loop=loop))


def test_waypoints_are_passed_in_their_order_also_between_two_ticks():
    along = np.column_stack([[0.0, 1.0, 2.0, 3.0, 4.0, 3.0], np.zeros(6)])
    assert progress.passings(walker((1.5, 0.1), (4.0, 0.0), (3.1, 0.0)), along).tolist() == [2, 4, 5]
    assert progress.passings(walker((3.0, 0.0), (1.0, 0.0)), along).tolist() == [3]  # it never comes back that far
    assert progress.passings(walker((2.0, 0.5)), along).tolist() == []


def test_a_route_that_loops_is_walked_round_and_round():
    to_and_fro = np.column_stack([[0.0, 1.0, 2.0, 1.0, 0.0, 1.0, 2.0], np.zeros(7)])
    assert progress.passings(walker((2.0, 0.0), (0.0, 0.0), loop=True), to_and_fro).tolist() == [2, 4, 6]


def test_who_is_not_there_passes_nothing():
    along = np.column_stack([[np.nan, np.nan, 2.0, 3.0, np.nan], [np.nan, np.nan, 0.0, 0.0, np.nan]])
    assert progress.passings(walker((2.0, 0.0), (3.0, 0.0), (4.0, 0.0)), along).tolist() == [2, 3]


def test_the_times_of_all_are_added_once_all_have_arrived():
    scenario = replace(make_scenario(), people=(walker((2.0, 0.0)), walker((9.0, 0.0), (3.0, 0.0), loop=True)))
    people = np.zeros((5, 2, 2))
    people[:, 0, 0] = [0.0, 1.0, 2.0, 2.0, 2.0]
    trajectory = make_trajectory(np.zeros((5, 2)), people=people)
    assert progress.aggregated_time(trajectory, scenario, outcome="goal") == pytest.approx(0.4 + 0.2)
    assert progress.aggregated_time(trajectory, scenario, outcome="timeout") is None
    still = make_trajectory(np.zeros((5, 2)), people=np.zeros((5, 2, 2)))
    assert progress.aggregated_time(still, scenario, outcome="goal") is None
    assert progress.aggregated_time(trajectory, make_scenario(num_people=2), outcome="goal") is None


@pytest.mark.parametrize("num", [0, 1, ROWS - 1, ROWS, ROWS + 1, 2 * ROWS, 2 * ROWS + 1])
def test_the_rows_are_those_of_the_whole(num):
    first, second = np.arange(num), np.arange(num)[:, None] ** 2
    found = by_blocks(lambda a, b: a[:, None] - b, first, second)
    assert np.array_equal(found, first[:, None] - second)


def test_the_figures_of_a_long_run_are_those_of_all_its_states(trajectory_through, scenario_with):
    rng = np.random.default_rng(1)
    num = 2 * ROWS + 2
    route, people = rng.uniform(0.0, 9.0, (num, 2)), rng.uniform(0.0, 9.0, (num, 2, 2))
    trajectory = trajectory_through(route, people=people)
    trajectory.estimate[:, :2] += rng.normal(size=(num - 1, 2))
    trajectory.tracks[..., :2] += rng.normal(size=(num - 1, 2, 2))
    errors = (
        (consistency.localization_rmse(trajectory), trajectory.estimate[:, :2] - route[:-1]),
        (consistency.tracking_rmse(trajectory), trajectory.tracks[..., :2] - people[:-1]),
    )
    for found, error in errors:
        assert found == pytest.approx(np.sqrt((error**2).sum(-1).mean()))
    distance = np.abs(route[:, 1])  # from the way along the x axis
    expected = np.trapezoid(distance) / (num - 1), distance.max()
    assert progress.deviation(trajectory, scenario_with()) == pytest.approx(expected)


def test_a_single_state_deviates_by_its_distance(trajectory_through, scenario_with):
    assert progress.deviation(trajectory_through([[2.0, 0.75]]), scenario_with()) == pytest.approx((0.75, 0.75))
