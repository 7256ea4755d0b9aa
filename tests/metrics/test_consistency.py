import numpy as np
import pytest
from scipy import stats

from mjnav.metrics import consistency


def test_localization_rmse_by_hand(trajectory_through):
    trajectory = trajectory_through([[0, 0], [1, 0], [2, 0]], estimate=np.array([[3.0, 4.0, 0.0], [1.0, 0.0, 0.0]]))
    assert consistency.localization_rmse(trajectory) == pytest.approx(np.sqrt((25 + 0) / 2))


def test_tracking_rmse_skips_people_without_a_track(trajectory_through):
    people = np.zeros((3, 2, 2))
    tracks = np.array([[[1.0, 0, 9, 9], [np.nan] * 4], [[0.0, 2.0, 9, 9], [2.0, 2.0, 9, 9]]])
    trajectory = trajectory_through([[0, 0], [1, 0], [2, 0]], people=people, tracks=tracks)
    assert consistency.tracking_rmse(trajectory) == pytest.approx(np.sqrt((1 + 4 + 8) / 3))


def test_the_tracks_error_is_that_of_places_and_velocities_at_the_tick(trajectory_through):
    people = np.array([[[1.0, 2.0]], [[3.0, 2.0]], [[5.0, 2.0]]])
    velocity = np.array([[[2.0, 0.0]], [[2.0, 0.5]], [[2.0, 1.0]]])
    tracks = np.array([[[1.5, 1.0, 2.25, 0.0]], [[3.0, 2.0, 2.0, 1.0]]])
    trajectory = trajectory_through([[0, 0], [1, 0], [2, 0]], people=people, people_velocity=velocity, tracks=tracks)
    assert consistency.track_error(trajectory).tolist() == [[[0.5, -1.0, 0.25, 0.0]], [[0.0, 0.0, 0.0, 0.5]]]
    assert consistency.tracking_rmse(trajectory) == pytest.approx(np.sqrt((0.25 + 1.0) / 2))


def test_a_wrong_heading_is_no_distance(trajectory_through):
    trajectory = trajectory_through([[0, 0], [1, 0]], estimate=np.array([[3.0, 4.0, 1.0]]))
    assert consistency.localization_rmse(trajectory) == 5.0


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


def test_nees_by_hand():
    error = np.array([[1.0, 2.0, 0.0]])
    covariance = np.diag([1.0, 4.0, 9.0])[None]
    np.testing.assert_allclose(consistency.nees(error, covariance), [2.0])


def test_a_covariance_that_cannot_be_inverted_has_no_nees():
    error = np.ones((4, 3))
    covariance = np.stack([np.eye(3), np.zeros((3, 3)), np.diag([1.0, 1.0, 1e-14]), np.full((3, 3), np.nan)])
    np.testing.assert_array_equal(np.isfinite(consistency.nees(error, covariance)), [True, False, False, False])
    assert consistency.mean_nees(error[1:], covariance[1:]) is None
    assert consistency.coverage(error[1:], covariance[1:]) is None


def test_errors_of_many_people_in_many_ticks_have_one_nees_each():
    error = np.zeros((2, 3, 4))
    error[1, 2] = [3.0, 0.0, 0.0, 0.0]  # 9 lies within the region of 4 dimensions, not in that of 3
    error[0, 1, 3] = np.nan
    covariance = np.tile(np.eye(4), (2, 3, 1, 1))
    assert consistency.nees(error, covariance) == pytest.approx(np.array([[0, np.nan, 0], [0, 0, 9]]), nan_ok=True)
    assert consistency.coverage(error, covariance) == 1.0
    assert consistency.mean_nees(error, covariance) == pytest.approx(9.0 / 5.0)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_in_one_place_has_no_nees(value):
    error, covariance = np.ones((3, 2)), np.tile(np.eye(2), (3, 1, 1))
    error[0, 1] = covariance[1, 0, 1] = value
    assert np.isfinite(consistency.nees(error, covariance)).tolist() == [False, False, True]
    assert np.isnan(consistency.nees(error, covariance)[:2]).all()


@pytest.mark.parametrize("dimensions", [3, 4])
def test_gaussian_errors_of_the_stated_covariance_are_consistent(dimensions):
    rng = np.random.default_rng(1)
    root = rng.normal(size=(dimensions, dimensions))
    error = rng.normal(size=(4000, dimensions)) @ root.T
    covariance = np.tile(root @ root.T, (4000, 1, 1))
    assert consistency.mean_nees(error, covariance) == pytest.approx(dimensions, abs=5 * np.sqrt(2 * dimensions / 4000))
    assert consistency.coverage(error, covariance) == pytest.approx(0.95, abs=5 * np.sqrt(0.95 * 0.05 / 4000))
    assert consistency.coverage(2.0 * error, covariance) < 0.9


def test_the_quantiles_are_those_of_chi_squared():
    for dimensions, quantile in consistency.CHI2_95.items():
        assert quantile == pytest.approx(stats.chi2.ppf(0.95, dimensions), rel=1e-12)


def test_skew_and_kurtosis_equal_scipys():
    samples = np.random.default_rng(2).gamma(2.0, size=(200, 3))
    skew, kurtosis = consistency.skew_and_kurtosis(samples)
    np.testing.assert_allclose(skew, stats.skew(samples))
    np.testing.assert_allclose(kurtosis, stats.kurtosis(samples, fisher=False))
    assert np.isnan(consistency.skew_and_kurtosis(np.ones((5, 1)))).all()
    in_millimetres = consistency.skew_and_kurtosis(1e-3 * samples)  # neither has a unit
    np.testing.assert_allclose(in_millimetres, (skew, kurtosis))
