"""Rows that come one by one are the arrays that they would be at once, to the last bit."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.log.read.trajectory import TrajectoryBuilder
from mjnav.loop.episode import Episode
from mjnav.messages import TickRecord, symmetric, triangle
from mjnav.scene import load


@pytest.mark.parametrize("n", [1, 3, 4])
def test_a_symmetric_matrix_is_made_of_its_triangle(n):
    root = np.random.default_rng(0).standard_normal((5, 2, n, n))
    matrices = root + np.swapaxes(root, -1, -2)
    triangles = triangle(matrices)
    assert triangles.shape == (5, 2, n * (n + 1) // 2)
    np.testing.assert_array_equal(symmetric(triangles, n), matrices)
    assert symmetric(np.empty((0, 0, n * (n + 1) // 2)), n).shape == (0, 0, n, n)


@pytest.mark.parametrize(("robot", "people"), [("particle", "particle"), ("ekf", "kalman")])
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


def test_a_track_without_a_name_counts_as_the_nearest_persons(crossing_tick):
    tick = crossing_tick
    track = tick.tracks[0]
    person = tick.truth.people_position[0]
    near = replace(track, name="track12", unseen=0.4, mean=np.array([*(person + 0.3), 0.5, 0.0]))
    far = replace(track, name="track7", mean=np.array([*(person + 2.0), 0.0, 0.0]))
    builder = TrajectoryBuilder()
    builder.add(replace(tick, tracks=(far, near)))
    trajectory = builder.finish(tick.truth)
    assert trajectory.track_states.tolist() == [[0, 7, *far.mean, 0.0], [0, 12, *near.mean, 0.4]]
    assert trajectory.tracks[0, 0].tolist() == near.mean.tolist()
    assert trajectory.track_covariance[0, 0].tolist() == near.covariance.tolist()


@pytest.fixture
def crossing_tick() -> TickRecord:
    seen: list[TickRecord] = []
    Episode(load("crossing1", ["time_limit=0.1", "physics.engine=kinematic"]), watch=seen.append).run()
    return seen[0]
