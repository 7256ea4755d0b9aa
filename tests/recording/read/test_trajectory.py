"""Rows that come one by one are the arrays that they would be at once, to the last bit."""

import numpy as np
import pytest

from mjnav.loop.episode import Episode
from mjnav.messages import TickRecord, symmetric, triangle
from mjnav.scenarios import load


@pytest.mark.parametrize("n", [1, 3, 4])
def test_a_symmetric_matrix_is_made_of_its_triangle(n):
    root = np.random.default_rng(0).standard_normal((5, 2, n, n))
    matrices = root + np.swapaxes(root, -1, -2)
    triangles = triangle(matrices)
    assert triangles.shape == (5, 2, n * (n + 1) // 2)
    np.testing.assert_array_equal(symmetric(triangles, n), matrices)
    assert symmetric(np.empty((0, 0, n * (n + 1) // 2)), n).shape == (0, 0, n, n)


@pytest.mark.parametrize(("robot", "people"), [("particle", "particle"), ("ekf", "kalman"), ("ukf", "kalman")])
def test_covariances_are_those_of_the_beliefs_to_the_last_bit(robot, people):
    filters = [f"estimation.robot.filter={robot}", f"estimation.obstacles.filter={people}"]
    scenario = load("crossing1", [*filters, "time_limit=1.0", "physics.engine=kinematic"])
    seen: list[TickRecord] = []
    trajectory = Episode(scenario, watch=seen.append).run().trajectory
    poses = np.array([record.belief.covariance for record in seen])
    tracks = np.array([[track.covariance for track in record.tracks] for record in seen])
    assert trajectory.estimate_covariance.tobytes() == poses.tobytes()
    assert trajectory.track_covariance.tobytes() == tracks.tobytes()
    assert trajectory.estimate.tobytes() == np.array([record.belief.mean for record in seen]).tobytes()
