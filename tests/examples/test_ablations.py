"""The example of ablations: its studies name every part, its parts are what their equations say, and they run."""

import importlib.util
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import mjnav
from mjnav.rkhs.gaussian import gaussian_mmd_squared
from mjnav.study.cells import resolve
from mjnav.study.study_file import load_study

FOLDER = Path(__file__).parents[2] / "examples" / "ablations"
PARTS = "OneMove StraightWay Reduced ReducedMean Tail Counted"


@pytest.fixture(scope="module")
def parts():
    spec = importlib.util.spec_from_file_location("parts", FOLDER / "parts.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def mmd_squared_from_all(gram, chosen):
    """Of equal weights on the chosen from equal weights on all, by the definition."""
    w = np.zeros(len(gram))
    w[chosen] = 1.0 / len(chosen)
    w -= 1.0 / len(gram)
    return w @ gram @ w


@pytest.mark.parametrize("part", PARTS.split())
def test_every_part_drives(part):
    overrides = {"physics.engine": "kinematic", "time_limit": 0.5, "control.samples": 24}
    scenario = mjnav.load_scenario("crossing3", overrides, controller=f"{FOLDER}/parts.py:{part}")
    assert mjnav.run(scenario, seed=0).summary["ticks"] == 5


@pytest.mark.parametrize("name", ["hilbert", "sizes", "particles"])
def test_a_study_is_found_whole_from_another_folder(name):
    study = load_study(FOLDER / f"{name}.toml")
    assert len(resolve(study)) == len(study.scenes) * len(study.methods) * max(len(study.settings), 1)


def test_the_studies_name_the_parts():
    studies = [load_study(FOLDER / f"{name}.toml") for name in ("ablations", "hilbert")]
    named = {method.controller.rpartition(":")[2] for study in studies for method in study.methods}
    assert set(PARTS.split()) <= named


def test_the_gram_matrix_is_that_of_standardised_samples_by_the_median_distance(parts):
    unit = np.array([[0.0], [1.0], [3.0]]) * np.array([1.0, 1e4])
    z = (unit - unit.mean(axis=0)) / unit.std(axis=0)
    squared = ((z[:, None] - z) ** 2).sum(axis=2)
    median = np.median([squared[0, 1], squared[0, 2], squared[1, 2]])
    assert parts.joint_gram(unit, 0.5) == pytest.approx(np.exp(-squared / (2.0 * 0.25 * median)))
    assert parts.joint_gram(np.full((4, 3), 0.1)).tolist() == np.ones((4, 4)).tolist()


def test_herded_samples_of_two_clusters_have_the_least_distance_of_all_subsets(parts):
    samples = np.repeat([[0.0], [1.0]], [8, 4], axis=0) + 0.01 * np.random.default_rng(0).normal(size=(12, 1))
    gram = parts.joint_gram(samples, 0.5)
    chosen = parts.herded(gram, 3)
    assert (chosen < 8).sum() == 2
    best = min(mmd_squared_from_all(gram, list(subset)) for subset in combinations(range(12), 3))
    assert mmd_squared_from_all(gram, chosen) <= best + 1e-4


def test_the_weights_of_a_reduced_set_have_the_least_distance(parts):
    rng = np.random.default_rng(1)
    gram = parts.joint_gram(rng.normal(size=(40, 3)))
    chosen = parts.herded(gram, 5)
    found = parts.nearest_weights(gram, chosen)
    assert found.min() >= 0.0
    assert found.sum() == pytest.approx(1.0)

    def squared(beta):
        w = np.full(40, -1.0 / 40.0)
        w[chosen] += beta
        return w @ gram @ w

    others = rng.dirichlet(np.ones(5), 2000)
    near = np.maximum(found + 0.01 * rng.normal(size=(2000, 5)), 0.0)
    assert squared(found) <= min(map(squared, [*others, *near / near.sum(axis=1, keepdims=True)])) + 1e-9


def test_a_weighted_distance_is_that_of_repeated_samples(parts):
    h, times = np.array([[0.0, 0.5, 1.5]]), np.array([1, 3, 2])
    repeated = np.repeat(h, times, axis=1)
    expected = np.sqrt(gaussian_mmd_squared(repeated.T, 6, 0.7))
    assert parts.weighted_mmd(h, times / 6.0, 0.7) == pytest.approx(expected)
