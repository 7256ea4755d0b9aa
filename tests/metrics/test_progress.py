import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.metrics import progress
from tests.metrics.conftest import make_scenario, make_trajectory


def test_the_path_is_the_sum_of_its_steps(trajectory_through):
    assert progress.path_length(trajectory_through([[0, 0], [3, 4], [3, 5]])) == pytest.approx(6.0)


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


def test_a_way_shorter_than_a_metre_has_a_ratio(trajectory_through, scenario_with):
    trajectory = trajectory_through([[0, 0], [0.5, 0]])
    assert progress.path_ratio(trajectory, scenario_with(goal=(0.25, 0.0))) == pytest.approx(2.0)


@pytest.mark.parametrize("start", [0.0, 5.0])
def test_deviation_is_the_time_mean_and_the_maximum(trajectory_through, scenario_with, start):
    # a triangle of height 2 over two of four periods: (2 * 2 / 2) / 4
    route = [[0, 0], [1, 0], [2, -2], [3, 0], [4, 0]]
    trajectory = trajectory_through(route, time=start + 0.1 * np.arange(5))
    assert progress.deviation(trajectory, scenario_with()) == pytest.approx((0.5, 2.0))


def test_being_behind_the_start_or_past_the_goal_is_no_deviation():
    corners = np.array([[0.0, 0.0], [10.0, 0.0]])
    points = np.array([[-3.0, 0.5], [5.0, 1.0], [13.0, -0.25], [-2.0, 0.0]])
    np.testing.assert_allclose(progress.lateral_distance(points, corners), [0.5, 1.0, 0.25, 0.0])


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


def test_a_single_state_deviates_by_its_distance(trajectory_through, scenario_with):
    assert progress.deviation(trajectory_through([[2.0, 0.75]]), scenario_with()) == pytest.approx((0.75, 0.75))


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


@given(arrays(float, st.tuples(st.integers(1, 6), st.just(2)), elements=st.floats(-10, 10)), st.booleans())
def test_success_weighted_by_path_length_is_a_share(route, success):
    found = progress.spl(make_trajectory(route), make_scenario(), success=success)
    assert found is not None
    assert 0.0 <= found <= 1.0


def test_a_goal_where_the_robot_starts_has_no_weighted_success(trajectory_through, scenario_with):
    assert progress.spl(trajectory_through([[0, 0]]), scenario_with(goal=(0.0, 0.0)), success=True) is None
