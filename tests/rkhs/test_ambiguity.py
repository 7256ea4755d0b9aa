from math import exp, sqrt

import numpy as np
import pytest

from mjnav.errors import InvalidValue
from mjnav.rkhs.ambiguity import Ambiguity, radius
from mjnav.rkhs.joint_gram import joint_gram


@pytest.fixture
def scene():
    """Joint samples (24, 5), and violations (9, 24) of which most are 0; the first row is 0, the last is full."""
    rng = np.random.default_rng(3)
    h = np.clip(rng.normal(-0.5, 1.0, size=(9, 24)), 0.0, 2.0)
    h[0], h[-1] = 0.0, rng.uniform(0.1, 2.0, size=24)
    return rng.gamma(2.0, size=(24, 5)), h


@pytest.mark.parametrize(("bandwidth", "ridge"), [(1.0, 0.1), (0.4, 1e-4), (3.0, 2.0)])
def test_the_norm_is_that_of_the_gram_matrix(scene, bandwidth, ridge):
    samples, h = scene
    regular = joint_gram(samples, bandwidth) + ridge * np.eye(24)
    expected = [sqrt(row @ np.linalg.solve(regular, row)) for row in h]
    ambiguity = Ambiguity.of(samples, bandwidth=bandwidth, ridge=ridge)
    assert ambiguity.norm(h) == pytest.approx(np.array(expected), rel=1e-9)
    assert ambiguity.bound(h, 0.3) == pytest.approx(h.mean(axis=1) + 0.3 * np.array(expected), rel=1e-9)
    assert ambiguity.bound(h, 0.0).tolist() == h.mean(axis=1).tolist()
    assert ambiguity.norm(h)[0] == 0.0


def test_two_samples_are_known_exactly():
    # Two samples lie one median distance apart, k = exp(-1/2): the eigenvalues are 1 + mu + k for a sum, 1 + mu - k
    # for a difference, which is charged more.
    h = np.array([[1.0, 1.0], [2.0, 0.0]])
    found = Ambiguity.of(np.array([[0.0], [7.0]]), ridge=0.25).norm(h)
    same, opposite = 2.0 / (1.25 + exp(-0.5)), 2.0 / (1.25 - exp(-0.5))
    assert found**2 == pytest.approx([same, same + opposite], rel=1e-12)


def test_no_reweighting_of_the_samples_within_the_radius_exceeds_the_bound_and_the_worst_one_attains_it(scene):
    samples, h = scene
    regular = joint_gram(samples) + 0.1 * np.eye(24)
    bound = Ambiguity.of(samples, ridge=0.1).bound(h, 0.2)[1:]
    shift = np.random.default_rng(0).normal(size=(500, 24))
    shift *= 0.2 / np.sqrt(np.einsum("is,st,it->i", shift, regular, shift))[:, None]
    assert ((1.0 / 24 + shift) @ h[1:].T <= bound + 1e-12).all()
    for row, most in zip(h[1:], bound, strict=True):
        worst = np.linalg.solve(regular, row)
        worst *= 0.2 / sqrt(worst @ regular @ worst)
        assert (1.0 / 24 + worst) @ row == pytest.approx(most, rel=1e-9)


def test_of_equal_violations_the_one_that_changes_sharply_with_the_noise_costs_more():
    x = np.linspace(-1.0, 1.0, 40)
    smooth, sharp = np.where(x > 0.0, 1.0, 0.0), np.where(np.arange(40) % 2, 1.0, 0.0)
    ambiguity = Ambiguity.of(x[:, None])
    by_smoothness = ambiguity.norm(np.array([smooth, sharp]))
    assert by_smoothness[1] > 1.5 * by_smoothness[0]


def test_the_radius_holds_for_draws_from_a_known_distribution():
    """A standard normal under exp(-(x - y)^2 / 2): E k(x, x') = 1/sqrt 3, E k(., y) = exp(-y^2 / 4) / sqrt 2."""
    rng, num, delta = np.random.default_rng(5), 20, 0.3
    squared = []
    for x in rng.normal(size=(2000, num)):
        within = np.exp(-((x[:, None] - x) ** 2) / 2.0).mean()
        squared.append(within - 2.0 * np.mean(np.exp(-(x**2) / 4.0)) / sqrt(2.0) + 1.0 / sqrt(3.0))
    distance = np.sqrt(squared)
    assert np.mean(squared) == pytest.approx((1.0 - 1.0 / sqrt(3.0)) / num, rel=0.1)
    assert np.mean(distance > radius(num, delta)) <= delta
    assert distance.mean() <= radius(num, 1.0)  # delta = 1 leaves the bound of the mean


def test_the_radius_is_known_exactly():
    assert radius(48, 1.0) == pytest.approx(1.0 / sqrt(48.0))
    assert radius(100, exp(-2.0)) == pytest.approx(0.1 * (1.0 + 2.0))


@pytest.mark.parametrize(
    ("key", "call"),
    [
        ("num_samples", lambda: radius(0, 0.1)),
        ("delta", lambda: radius(10, 0.0)),
        ("delta", lambda: radius(10, 1.1)),
        ("ridge", lambda: Ambiguity.of(np.zeros((3, 1)), ridge=0.0)),
        ("bandwidth", lambda: Ambiguity.of(np.zeros((3, 1)), bandwidth=np.nan)),
    ],
)
def test_bad_input_is_refused_by_its_name(key, call):
    with pytest.raises(InvalidValue) as error:
        call()
    assert error.value.key == key
