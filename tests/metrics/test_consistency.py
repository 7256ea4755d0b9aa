import numpy as np
import pytest
from scipy import stats

from mjnav.messages import triangle
from mjnav.metrics import consistency
from mjnav.metrics.consistency import recoveries
from mjnav.scene.faults import Faults, Kidnapping


def test_the_tracks_error_is_that_of_places_and_velocities_at_the_tick(trajectory_through):
    people = np.array([[[1.0, 2.0]], [[3.0, 2.0]], [[5.0, 2.0]]])
    velocity = np.array([[[2.0, 0.0]], [[2.0, 0.5]], [[2.0, 1.0]]])
    tracks = np.array([[[1.5, 1.0, 2.25, 0.0]], [[3.0, 2.0, 2.0, 1.0]]])
    trajectory = trajectory_through([[0, 0], [1, 0], [2, 0]], people=people, people_velocity=velocity, tracks=tracks)
    assert consistency.track_error(trajectory).tolist() == [[[0.5, -1.0, 0.25, 0.0]], [[0.0, 0.0, 0.0, 0.5]]]
    assert consistency.tracking_rmse(trajectory) == pytest.approx(np.sqrt((0.25 + 1.0) / 2))


def test_who_was_not_seen_for_some_time_counts_in_one_error_of_tracks_and_not_in_the_other(trajectory_through):
    people = np.zeros((3, 2, 2))
    tracks = np.array([[[1.0, 0, 9, 9], [0.0, 3.0, 9, 9]], [[2.0, 0, 9, 9], [np.nan] * 4]])
    states = [
        [0, 4, *tracks[0, 1], 0.4],
        [0, 5, *tracks[0, 0], 0.2],
        [1, 5, *tracks[1, 0], 0.0],
        [1, 6, 7, 7, 0, 0, 2.0],
    ]
    route = [[0, 0], [1, 0], [2, 0]]
    trajectory = trajectory_through(route, people=people, tracks=tracks, track_states=np.array(states))
    assert consistency.tracking_rmse(trajectory) == pytest.approx(np.sqrt((1 + 9 + 4) / 3))
    assert consistency.seen_tracking_rmse(trajectory) == pytest.approx(np.sqrt((1 + 4) / 2))
    named = trajectory_through(route, people=people, tracks=tracks)
    assert consistency.seen_tracking_rmse(named) == consistency.tracking_rmse(named)
    people[2] = 50.0  # after the last tick
    assert consistency.seen_tracking_rmse(trajectory) == pytest.approx(np.sqrt((1 + 4) / 2))


def test_nobody_to_track_and_no_tick_have_no_error(trajectory_through):
    assert consistency.tracking_rmse(trajectory_through([[0, 0], [1, 0]])) is None
    assert consistency.localization_rmse(trajectory_through([[0, 0]])) is None


def test_the_headings_error_is_wrapped(trajectory_through):
    trajectory = trajectory_through([[0, 0], [1, 0]], estimate=np.array([[0.0, 0.0, 3.1]]))
    pose = trajectory.robot_pose
    pose[:, 2] = -3.1
    np.testing.assert_allclose(consistency.robot_error(trajectory)[0, 2], 6.2 - 2 * np.pi)


def test_the_robots_error_is_that_at_the_tick(trajectory_through):
    trajectory = trajectory_through([[0, 0], [1, 0], [2, 0]], estimate=np.array([[0.5, 0.0, 0.25], [1.0, -1.0, 0.0]]))
    assert consistency.robot_error(trajectory).tolist() == [[0.5, 0.0, 0.25], [0.0, -1.0, 0.0]]


def test_skew_and_kurtosis_equal_scipys():
    samples = np.random.default_rng(2).gamma(2.0, size=(200, 3))
    skew, kurtosis = consistency.skew_and_kurtosis(samples)
    np.testing.assert_allclose(skew, stats.skew(samples))
    np.testing.assert_allclose(kurtosis, stats.kurtosis(samples, fisher=False))
    assert np.isnan(consistency.skew_and_kurtosis(np.ones((5, 1)))).all()
    in_millimetres = consistency.skew_and_kurtosis(1e-3 * samples)  # neither has a unit
    np.testing.assert_allclose(in_millimetres, (skew, kurtosis))


@pytest.mark.parametrize("num", [3, 4])
def test_nees_is_the_errors_quadratic_form_in_the_inverse_covariance(num):
    rng = np.random.default_rng(num)
    error, root = rng.normal(size=(7, 2, num)), rng.normal(size=(7, 2, num, num))
    covariance = root @ np.swapaxes(root, -1, -2)
    expected = [
        [e @ np.linalg.inv(p) @ e for e, p in zip(*row, strict=True)] for row in zip(error, covariance, strict=True)
    ]
    np.testing.assert_allclose(consistency.nees(error, triangle(covariance)), expected, rtol=1e-7)


def test_nees_of_errors_drawn_from_their_covariance_is_chi_squared_and_lies_in_its_interval(trajectory_through):
    rng = np.random.default_rng(8)
    covariance = np.array([[0.04, 0.01, 0.0], [0.01, 0.02, 0.01], [0.0, 0.01, 0.09]])
    ticks = 3000
    truth = np.column_stack([np.zeros((ticks + 1, 2)), np.full(ticks + 1, 3.1)])  # headings wrap
    estimate = truth[:-1] + rng.multivariate_normal(np.zeros(3), covariance, ticks)
    trajectory = trajectory_through(
        np.zeros((ticks + 1, 2)),
        robot_pose=truth,
        estimate=estimate,
        estimate_triangle=np.tile(triangle(covariance), (ticks, 1)),
    )
    values = consistency.robot_nees(trajectory)
    assert stats.kstest(values, stats.chi2(3).cdf).pvalue > 0.01
    found = consistency.of_robot(trajectory)
    assert found.nees is not None
    assert found.coverage is not None
    low, high = stats.chi2(3 * ticks).ppf([0.025, 0.975]) / ticks
    assert low < found.nees < high
    assert found.nees_interval == pytest.approx((low, high))
    assert stats.binomtest(round(found.coverage * ticks), ticks, 0.95).pvalue > 0.01
    assert (found.ticks, found.divergences) == (ticks, 0)


def test_all_people_are_judged_together_by_the_four_numbers_of_a_track(trajectory_through):
    people = np.zeros((6, 2, 2))
    tracks = np.tile([[[1.0, 0.0, 0.0, 2.0], [np.nan] * 4]], (5, 1, 1))
    found = consistency.of_people(trajectory_through(np.zeros((6, 2)), people=people, tracks=tracks))
    low, high = stats.chi2(4 * 5).ppf([0.025, 0.975]) / 5
    assert (found.ticks, found.nees, found.nees_interval) == (5, 5.0, pytest.approx((low, high)))
    tracks[:] = np.nan
    nobody = consistency.of_people(trajectory_through(np.zeros((6, 2)), people=people, tracks=tracks))
    assert nobody == consistency.Consistency(0, None, None, None, 0)


def test_an_estimate_that_claims_to_be_exact_is_right_or_infinitely_wrong():
    error = np.array([[0.0, 0.0, 0.2], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0], [np.nan, 0.0, 0.0]])
    known = triangle(np.diag([0.0, 0.0, 0.01]))
    found = consistency.nees(error, np.tile(known, (4, 1)))
    np.testing.assert_allclose(found, [4.0, np.inf, 0.0, np.nan])
    line = triangle(np.array([[1.0, 1.0], [1.0, 1.0]]))  # x = y is known exactly
    np.testing.assert_allclose(consistency.nees(np.array([[2.0, 2.0], [2.0, 1.0]]), np.tile(line, (2, 1))), [4, np.inf])
    assert consistency.consistency(found, 3, np.arange(5.0)).coverage == pytest.approx(2 / 3)


def test_an_estimate_diverges_where_it_is_out_of_its_region_for_a_second(trajectory_through):
    beyond = consistency.region(0.999, 4) + 0.1
    found = np.ones((40, 2))
    found[3:13, 0] = beyond  # 1 s
    found[20:29, 0] = beyond  # 0.9 s
    found[5:40, 1] = beyond
    found[15, 1] = np.nan  # 1 s before, 2.4 s after the gap
    time = 0.1 * np.arange(41)
    assert consistency.consistency(found, 4, time).divergences == 3
    assert consistency.region(0.999, 4) == pytest.approx(stats.chi2(4).ppf(0.999))


def test_beliefs_are_depleted_by_their_own_number_of_particles(trajectory_through, scenario_with):
    trajectory = trajectory_through(
        np.zeros((5, 2)),
        robot_ess=np.array([9.0, 11.0, 3.0, np.nan]),
        robot_particles=np.array([500.0, 500.0, np.nan, np.nan]),
    )
    particles = consistency.robot_particles(trajectory, scenario_with())
    assert particles.tolist() == [500.0] * 4  # those that are set, where the log does not say it
    assert consistency.depleted_share(trajectory.robot_ess, particles) == pytest.approx(2 / 3)
    assert consistency.depleted_share(np.array([9.0]), 80) == 0.0
    assert consistency.depleted_share(np.array([np.nan]), 80) is None


TICKS = 60  # of 0.1 s; the robot stands at x = 0, from tick 20 on at x = 5


def run(trajectory_through, *, wrong, ticks=TICKS, jump=20, turned=()):
    """The believed x is 1 m off in ticks from `wrong[0]` to before `wrong[1]`, and so on; the heading in `turned`."""
    x = np.where(np.arange(ticks + 1) < jump, 0.0, 5.0)
    trajectory = trajectory_through(np.stack([x, np.zeros(ticks + 1)], axis=1))
    for begin, end in wrong:
        trajectory.estimate[begin:end, 0] += 1.0
    for begin, end in turned:
        trajectory.estimate[begin:end, 2] += 2.0 * np.pi - 0.4
    return trajectory


def kidnapped(scenario_with, *times):
    kidnap = tuple(Kidnapping(time, (5.0, 0.0, 0.0)) for time in times)
    return scenario_with(faults=Faults(kidnap))


@pytest.mark.parametrize(
    ("wrong", "turned", "expected"),
    [
        ([(20, 35)], [], 1.5),
        ([(20, 35), (40, 45)], [], 2.5),  # right for half a second in between, which is not steady
        ([(20, 35), (45, 50)], [], 1.5),  # right for a second, and lost again
        ([(20, 35)], [(35, 41)], 2.1),  # the heading is off by 0.4 rad for longer
        ([(20, 60)], [], None),
        ([(20, 57)], [], 3.7),  # to the end of the run
        ([], [], 0.0),
    ],
)
def test_recovery_counts_to_the_first_steady_second(trajectory_through, scenario_with, wrong, turned, expected):
    times = recoveries(run(trajectory_through, wrong=wrong, turned=turned), kidnapped(scenario_with, 2.0))
    assert times == (expected,)


def test_it_counts_from_when_the_robot_is_seen_elsewhere(trajectory_through, scenario_with):
    times = recoveries(run(trajectory_through, wrong=[(25, 30)], jump=25), kidnapped(scenario_with, 2.0))
    assert times == (0.5,)


def test_the_next_kidnapping_ends_the_time_to_recover(trajectory_through, scenario_with):
    trajectory = run(trajectory_through, wrong=[(20, 50)])
    trajectory.robot_pose[40:, 0] = -5.0
    trajectory.estimate[40:, 0] = np.where(np.arange(40, TICKS) < 50, 0.0, -5.0)
    times = recoveries(trajectory, kidnapped(scenario_with, 2.0, 4.0))
    assert times == (None, 1.0)


def test_localization_rmse_by_hand(trajectory_through):
    trajectory = trajectory_through([[0, 0], [1, 0], [2, 0]], estimate=np.array([[3.0, 4.0, 0.0], [1.0, 0.0, 0.0]]))
    assert consistency.localization_rmse(trajectory) == pytest.approx(np.sqrt((25 + 0) / 2))


def test_a_kidnapping_that_the_run_does_not_reach_does_not_count(trajectory_through, scenario_with):
    times = recoveries(run(trajectory_through, wrong=[(20, 25)]), kidnapped(scenario_with, 2.0, 99.0))
    assert times == (0.5,)
