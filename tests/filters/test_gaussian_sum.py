import numpy as np
import pytest

from mjnav.filters.mixture_kalman import GaussianSum, fitted

SKEWED = GaussianSum(
    np.array([0.3, 0.7]),
    np.array([[1.0, -0.5], [-0.4, 0.2]]),
    np.array([[[0.5, 0.1], [0.1, 0.2]], [[0.3, -0.1], [-0.1, 0.4]]]),
)


def test_a_stretched_sum_has_means_and_covariances_by_the_cholesky_factor():
    covariance = np.array([[2.0, 0.6], [0.6, 0.5]])
    root = np.linalg.cholesky(covariance)
    found = SKEWED.stretched(covariance)
    assert found.means == pytest.approx(SKEWED.means @ root.T)
    assert found.covariances == pytest.approx(root @ SKEWED.covariances @ root.T)
    assert found.variance == pytest.approx(root @ SKEWED.variance @ root.T)


def test_two_sums_beside_each_other_are_independent():
    x = fitted(np.random.default_rng(0).standard_gamma(2.0, 500), 2)
    y = fitted(np.random.default_rng(1).standard_gamma(3.0, 500), 3)
    both = x.beside(y)
    assert both.weights.sum() == pytest.approx(1.0)
    assert both.variance == pytest.approx(np.diag([x.variance[0, 0], y.variance[0, 0]]), abs=1e-12)


def test_a_fit_finds_the_gaussians_that_draws_come_from():
    rng = np.random.default_rng(2)
    draws = np.concatenate([rng.normal(-1.0, 0.2, 2000), rng.normal(1.0, 0.5, 2000)])
    found = fitted(draws, 2)
    assert found.weights == pytest.approx([0.5, 0.5], abs=0.02)
    assert found.means.ravel() == pytest.approx([-1.0, 1.0], abs=0.03)
    assert np.sqrt(found.covariances.ravel()) == pytest.approx([0.2, 0.5], abs=0.03)


def test_draws_that_are_all_alike_give_one_gaussian_of_the_least_std():
    found = fitted(np.full(100, 0.3), 3, least_std=0.01)
    assert (found.weights.tolist(), found.means.tolist()) == ([1.0], [[pytest.approx(0.3)]])
    assert found.covariances.ravel() == pytest.approx([1e-4])
