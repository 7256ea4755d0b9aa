import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.filters.particles import ess, reweigh, weighted_moments
from mjnav.geometry.angles import circular_mean, wrap

LIKELIHOODS = arrays(
    float, st.tuples(st.integers(1, 3), st.integers(1, 4), st.integers(1, 30)), elements=st.floats(1e-9, 1e9)
)


def test_bayes_rule_gives_the_exact_shares():
    prior = np.array([[0.5, 0.5], [0.25, 0.75]])
    factors = np.array([[[1.0, 3.0], [3.0, 1.0]], [[2.0, 2.0], [0.5, 0.5]]])
    posterior, expected = reweigh(prior, factors)
    assert posterior == pytest.approx(np.array([[0.25, 0.75], [0.5, 0.5]]), rel=1e-15)
    assert expected == pytest.approx(np.array([[2.0, 1.5], [2.0, 0.5]]), rel=1e-15)


@given(LIKELIHOODS, st.floats(1e-6, 1e6))
def test_a_common_factor_changes_no_weight_and_the_order_of_the_channels_neither(likelihoods, scale):
    prior = np.random.default_rng(0).dirichlet(np.ones(likelihoods.shape[2]), likelihoods.shape[1])
    posterior, expected = reweigh(prior, likelihoods)
    product = prior * np.prod(likelihoods, axis=0)
    assert posterior == pytest.approx(product / product.sum(axis=1, keepdims=True), rel=1e-9)
    assert expected == pytest.approx((prior * likelihoods).sum(axis=2), rel=1e-9)
    scaled, scaled_expected = reweigh(prior, np.ascontiguousarray(scale * likelihoods[::-1]))
    assert scaled == pytest.approx(posterior, rel=1e-9)
    assert scaled_expected == pytest.approx(scale * expected[::-1], rel=1e-9)


def test_where_every_product_underflows_the_posterior_is_uniform():
    posterior, _ = reweigh(np.full((1, 4), 0.25), np.full((2, 1, 4), 1e-200))
    assert posterior.tolist() == [[0.25] * 4]


@pytest.mark.parametrize(
    ("weights", "size"),
    [([0.25] * 4, 4.0), ([0, 1, 0], 1.0), ([0.5, 0.5, 0, 0], 2.0), ([0.5, 0.25, 0.25], 8 / 3), ([2, 1, 1], 8 / 3)],
)
def test_effective_sample_size_of_exact_cases(weights, size):
    assert ess(np.array([weights, weights], float)) == pytest.approx([size, size], rel=1e-15)


def test_moments_are_those_that_numpy_computes_for_each_filter_alone():
    rng = np.random.default_rng(1)
    particles, weights = rng.normal(size=(5, 40, 3)), rng.dirichlet(np.ones(40), 5)
    mean, covariance = weighted_moments(particles, weights)
    for b in range(5):
        assert mean[b] == pytest.approx(np.average(particles[b], axis=0, weights=weights[b]), abs=1e-14)
        assert covariance[b] == pytest.approx(np.cov(particles[b].T, aweights=weights[b], ddof=0), abs=1e-14)


def test_moments_of_headings_are_circular():
    rng = np.random.default_rng(2)
    particles, weights = 4.0 * rng.normal(size=(3, 30, 3)), rng.dirichlet(np.ones(30), 3)
    mean, covariance = weighted_moments(particles, weights, 2)
    for b in range(3):
        assert wrap(mean[b, 2] - circular_mean(particles[b, :, 2], weights[b])) == pytest.approx(0.0, abs=1e-12)
        deviation = particles[b] - mean[b]
        deviation[:, 2] = wrap(deviation[:, 2])
        assert covariance[b] == pytest.approx((weights[b] * deviation.T) @ deviation, abs=1e-13)


def test_headings_on_both_sides_of_pi_have_their_mean_at_pi_and_a_small_variance():
    particles = np.array([[[0.0, 0.0, np.pi - 0.1], [1.0, 0.0, -np.pi + 0.1]]])
    (mean,), (covariance,) = weighted_moments(particles, np.array([[0.5, 0.5]]), 2)
    assert abs(mean[2]) == pytest.approx(np.pi, abs=1e-12)
    assert covariance[2, 2] == pytest.approx(0.01, abs=1e-12)
    assert covariance[0, 2] == pytest.approx(0.05, abs=1e-12)
