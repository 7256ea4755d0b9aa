"""The example of a learned policy: it runs with the weights that are there, and training repeats itself."""

import os
import subprocess
import sys
from pathlib import Path

import mjnav

FOLDER = Path(__file__).parents[2] / "examples" / "policy"


def test_the_trained_policy_reaches_the_goal_past_who_crosses_its_way():
    scenario = mjnav.load_scenario(
        "crossing1", {"physics.engine": "kinematic"}, controller=f"{FOLDER}/policy.py:Policy"
    )
    summary = mjnav.run(scenario, seed=0).summary
    assert summary["success"], summary


CODE = """
import numpy as np
import train
from policy import untrained

if __name__ == "__main__":
    first, again = (train.total_reward(untrained(), range(3, 4)) for _ in range(2))
    assert first == again, (first, again)
    weights = train.train(generations=1, minutes=1.0, seed=3, episodes=1, population=4, processes=1, sigma=0.5)
    assert weights.shape == untrained().shape == np.load("weights.npz")["weights"].shape
    assert (weights != untrained()).any()
"""


def test_an_episode_of_the_training_repeats_itself_and_a_generation_changes_the_weights():
    environment = {**os.environ, "PYTHONPATH": str(FOLDER)}
    command = [sys.executable, "-c", CODE]
    done = subprocess.run(command, cwd=FOLDER, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "generation   1  reward: mean" in done.stdout


ROOMS = """
from ppo import Rooms

first, again = Rooms(3), Rooms(3)
seen = [(first.reset()[0], again.reset()[0]) for _ in range(3)]
assert all((one[name] == other[name]).all() for one, other in seen for name in one)
assert (seen[0][0]["robot"] != seen[1][0]["robot"]).any()
"""


def test_the_rooms_that_a_network_is_trained_in_follow_from_their_seed_and_differ():
    environment = {**os.environ, "PYTHONPATH": str(FOLDER)}
    done = subprocess.run(
        [sys.executable, "-c", ROOMS], cwd=FOLDER, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
