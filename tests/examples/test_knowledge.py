"""The example of what is known of people: the true future is one, and every prediction drives."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np

from mjnav.motion.published_crowds import PublishedCrowd

FILE = Path(__file__).parents[2] / "examples" / "knowledge" / "ladder.py"
spec = importlib.util.spec_from_file_location("ladder", FILE)
ladder = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ladder)


def test_the_true_future_is_where_people_are_then_and_the_others_begin_there():
    crowd, rng = PublishedCrowd("crowdnav-plus", 300), np.random.default_rng(0)
    for _ in range(8):
        crowd.move(crowd.velocities(), crowd.robot)
    found = {name: ladder.predictor(name)(crowd, rng) for name in ladder.PREDICTIONS}
    near = crowd.position[:, None] + crowd.rules.period * crowd.velocity[:, None]
    assert np.abs(found["straight"][:, :, 0] - near).max() < 1e-12
    assert np.abs(np.median(found["turns"][:, :, 0], axis=1, keepdims=True) - near).max() < 0.05
    for step in range(ladder.STEPS):
        crowd.move(crowd.velocities(), crowd.robot)
        assert (found["truth"][:, 0, step] == crowd.position).all()
    last = {name: np.hypot(*(paths[:, 0, -1] - crowd.position).T).mean() for name, paths in found.items()}
    assert last["truth"] == 0.0 < last["reactions"] < last["turns"]


def test_who_goes_to_waypoints_walks_the_length_that_time_allows_and_stays_at_the_last():
    crowd, rng = PublishedCrowd("crowdnav-plus", 300), np.random.default_rng(0)
    crowd.position, crowd.max_speed = np.zeros((2, 2)), np.array([0.5, 1.5])
    crowd.goal = [np.array([[0.5, 0.0], [0.5, 5.0]]), np.array([0.0, 2.0])]
    paths = ladder.waypoints(crowd, rng)[:, 0]
    assert np.abs(paths[0, [1, 3, 7]] - [[0.25, 0.0], [0.5, 0.0], [0.5, 0.5]]).max() < 1e-12
    assert np.abs(paths[1, [3, 7, 15]] - [[0.0, 1.0], [0.0, 2.0], [0.0, 2.0]]).max() < 1e-12


def test_conformal_radii_hold_the_share_of_people_that_they_are_to():
    crowd, rng, predict = PublishedCrowd("crowdnav-plus", 301), np.random.default_rng(0), ladder.predictor("conformal")
    made, within = [], []
    for _ in range(120):
        made.append(predict(crowd, rng))
        crowd.move(crowd.velocities(), crowd.robot)
        if len(made) > 40:
            paths = made[-4]  # whose fourth step is now
            radius = np.hypot(*(paths[:, 1, 3] - paths[:, 0, 3]).T)
            within.append(np.hypot(*(crowd.position - paths[:, 0, 3]).T) <= radius)
    assert abs(np.mean(within) - (1.0 - ladder.MISSED)) < 0.08


def test_the_ladder_prints_a_row_for_each_prediction():
    done = subprocess.run([sys.executable, FILE, "--cases", "1", "--first", "300"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    rows = done.stdout.splitlines()
    assert [row.split()[0] for row in rows] == list(ladder.PREDICTIONS)
    assert "success 100.0 %" in rows[-1]
