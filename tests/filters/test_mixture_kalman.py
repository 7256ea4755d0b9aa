import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.stats import multivariate_normal

from mjnav.filters.mixture_kalman import GaussianSum, corrected, explained, fitted, kept, moments, sampled


def particles(num, rng):
    weights = rng.random(num)
    roots = rng.normal(size=(num, 4, 4))
    return weights / weights.sum(), rng.normal(size=(num, 4)), roots @ roots.swapaxes(1, 2)


NOISE = (
    np.array([0.4, 0.6]),
    np.array([[0.3, -0.1], [-0.2, 0.1]]),
    np.array([0.2 * np.eye(2), [[0.3, 0.1], [0.1, 0.2]]]),
)


@pytest.mark.parametrize("age", [0.0, 0.3])
def test_every_product_is_updated_as_filterpys_kalman_filter_would_be(age):
    rng = np.random.default_rng(0)
    weights, mean, covariance = particles(3, rng)
    z, H = np.array([0.4, -0.7]), np.hstack([np.eye(2), -age * np.eye(2)])
    joint = explained(weights, mean, covariance, z, age, *NOISE, 0.05)
    owner, m, P = corrected(np.arange(9), mean, covariance, z, age, *NOISE[1:])
    assert owner.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    for i in range(3):
        for k in range(2):
            kalman = KalmanFilter(dim_x=4, dim_z=2)
            kalman.x, kalman.P, kalman.H, kalman.R = mean[i], covariance[i], H, NOISE[2][k]
            kalman.update(z - NOISE[1][k])
            law = multivariate_normal(H @ mean[i] + NOISE[1][k], H @ covariance[i] @ H.T + NOISE[2][k])
            assert joint[3 * i + k] == pytest.approx(weights[i] * NOISE[0][k] * law.pdf(z))
            assert m[3 * i + k] == pytest.approx(kalman.x)
            assert P[3 * i + k] == pytest.approx(kalman.P)
        assert joint[3 * i + 2] == pytest.approx(0.05 * weights[i])  # of the floor, which teaches nothing
        assert m[3 * i + 2] == pytest.approx(mean[i])
        assert P[3 * i + 2] == pytest.approx(covariance[i])


def test_moments_and_samples_are_those_of_the_mixture():
    weights, mean, covariance = particles(5, np.random.default_rng(1))
    m, P = moments(weights, mean, covariance)
    centred = mean - weights @ mean
    assert m == pytest.approx(weights @ mean)
    assert pytest.approx(np.einsum("k,kij->ij", weights, covariance + centred[:, :, None] * centred[:, None])) == P
    drawn = sampled(weights, 0.5, mean, covariance, np.random.default_rng(2).standard_normal((100_000, 4)))
    assert drawn.mean(axis=0) == pytest.approx(m, abs=0.05)
    assert np.cov(drawn.T) == pytest.approx(P, rel=0.05, abs=0.15)


def test_resampling_keeps_the_heavy_as_they_are_and_the_light_by_chance():
    weights = np.array([0.5, 0.3, 0.1, 0.05, 0.05])
    # min(w / c, 1) sums to 3 for c = 0.2 / 1: the two heavy ones count 1 each, the rest 0.2 / 0.2.
    for offset in np.linspace(0.0, 1.0, 11, endpoint=False):
        indices, new = kept(weights, 3, offset)
        assert indices[:2].tolist() == [0, 1]
        assert len(indices) == 3
        assert new == pytest.approx([0.5, 0.3, 0.2])


def test_resampling_changes_no_weight_on_average():
    rng = np.random.default_rng(3)
    weights = rng.random(200) ** 6
    weights /= weights.sum()
    mean = np.zeros(200)
    offsets = (np.arange(2000) + 0.5) / 2000
    for offset in offsets:
        indices, new = kept(weights, 40, offset)
        assert 39 <= len(indices) <= 41
        mean[indices] += new / len(offsets)
    assert mean == pytest.approx(weights, abs=5e-4)


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


def test_two_sums_beside_each_other_are_independent():
    x = fitted(np.random.default_rng(0).standard_gamma(2.0, 500), 2)
    y = fitted(np.random.default_rng(1).standard_gamma(3.0, 500), 3)
    both = x.beside(y)
    assert both.weights.sum() == pytest.approx(1.0)
    assert both.variance == pytest.approx(np.diag([x.variance[0, 0], y.variance[0, 0]]), abs=1e-12)


def test_few_particles_stay_and_those_of_no_weight_go():
    indices, new = kept(np.array([0.25, 0.0, 0.75]), 5, 0.3)
    assert (indices.tolist(), new.tolist()) == ([0, 2], [0.25, 0.75])
    assert new.sum() == 1.0


def test_samples_of_a_particle_without_spread_are_its_mean():
    mean, covariance = np.array([[1.0, 2.0, 3.0, 4.0]]), np.zeros((1, 4, 4))
    assert sampled(np.ones(1), 0.0, mean, covariance, np.ones((2, 4))).tolist() == 2 * mean.tolist()
