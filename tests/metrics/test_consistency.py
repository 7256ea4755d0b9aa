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


def test_skew_and_kurtosis_equal_scipys():
    samples = np.random.default_rng(2).gamma(2.0, size=(200, 3))
    skew, kurtosis = consistency.skew_and_kurtosis(samples)
    np.testing.assert_allclose(skew, stats.skew(samples))
    np.testing.assert_allclose(kurtosis, stats.kurtosis(samples, fisher=False))
    assert np.isnan(consistency.skew_and_kurtosis(np.ones((5, 1)))).all()
    in_millimetres = consistency.skew_and_kurtosis(1e-3 * samples)  # neither has a unit
    np.testing.assert_allclose(in_millimetres, (skew, kurtosis))
