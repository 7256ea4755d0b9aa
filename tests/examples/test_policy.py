"""The example of a learned policy: it runs with the weights that are there, and training repeats itself."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np

import mjnav

FOLDER = Path(__file__).parents[2] / "examples" / "policy"


def test_the_trained_policy_reaches_the_goal_past_who_crosses_its_way():
    scenario = mjnav.load_scenario(
        "crossing1", {"physics.engine": "kinematic"}, controller=f"{FOLDER}/policy.py:Policy"
    )
    summary = mjnav.run(scenario, seed=0).summary
    assert summary["success"], summary


def test_training_with_one_seed_ends_in_one_vector_of_weights(tmp_path):
    for name in ("first.npz", "again.npz"):
        options = f"--generations 1 --population 4 --episodes 1 --processes 1 --seed 3 --out {tmp_path / name}"
        environment = {**os.environ, "PYTHONPATH": str(FOLDER.parents[1])}
        command = [sys.executable, str(FOLDER / "train.py"), *options.split()]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        assert "generation   1  reward: mean" in done.stdout
    first, again = (np.load(tmp_path / name)["weights"] for name in ("first.npz", "again.npz"))
    np.testing.assert_array_equal(first, again)
    assert first.shape == np.load(FOLDER / "weights.npz")["weights"].shape
