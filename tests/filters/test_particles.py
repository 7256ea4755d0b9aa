import numpy as np
import pytest
from filterpy.monte_carlo import resampling as filterpy_resampling
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from mjnav.filters.particles import ess, resample, reweigh, roughen, shuffled, systematic, weighted_moments
from mjnav.geometry.angles import circular_mean, wrap

OFFSETS = st.floats(0.0, 1.0 - 1e-9)  # closer to 1, offset + i rounds to i + 1: a draw of probability 1e-16 a particle
WEIGHTS = st.lists(st.integers(0, 1000), min_size=1, max_size=40).filter(sum).map(lambda w: np.array(w) / sum(w))
LAST_OFFSET = np.nextafter(1.0, 0.0)


def drawn(weights, offset, num=None):
    """As often as there are particles, unless `num` is given."""
    return systematic(np.array(weights, float), offset, len(weights) if num is None else num)


def test_draws_of_small_cases_are_exact():
    assert drawn([0.5, 0.25, 0.25], 0.5, num=4).tolist() == [0, 0, 1, 2]
    assert drawn([0.1, 0.2, 0.3, 0.4], 0.0).tolist() == [0, 1, 2, 3]
    assert drawn([0.1, 0.2, 0.3, 0.4], 0.5).tolist() == [1, 2, 3, 3]
    assert drawn([0.0, 1.0, 0.0], 0.0).tolist() == [1, 1, 1]
    assert drawn([0.5, 0.5], 0.9, num=1).tolist() == [1]
    assert drawn([1.0], 0.3, num=0).tolist() == []


@given(WEIGHTS)
def test_resampling_is_unbiased(weights):
    offsets = (np.arange(200) + 0.5) / 200
    counts = np.array([np.bincount(drawn(weights, u, 7), minlength=weights.size) for u in offsets])
    assert counts.mean(axis=0) == pytest.approx(7 * weights, abs=1.01 / offsets.size)


@given(WEIGHTS, OFFSETS)
def test_draws_equal_filterpys_with_its_generator_pinned(weights, u):
    weights = weights / weights.sum()
    assume(np.cumsum(weights)[-1] == 1.0)  # filterpy runs past the end of other weights
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(filterpy_resampling, "random", lambda: u)
        assert drawn(weights, u).tolist() == filterpy_resampling.systematic_resample(weights).tolist()


def test_weights_that_sum_to_slightly_less_than_one_lose_no_draw():
    weights = np.full(10, 0.1)
    assert np.cumsum(weights)[-1] < 1.0
    for num in (10, 10**6):
        indices = drawn(np.append(weights, 0.0), LAST_OFFSET, num)
        assert indices.size == num
        assert indices[-1] == 9
    assert drawn([0.3, 0.0], LAST_OFFSET, 10).tolist() == [0] * 10


def test_shuffled_draws_are_the_systematic_ones_without_their_order():
    rng = np.random.default_rng(5)
    weights = rng.dirichlet(np.ones(200))
    correlations = []
    for seed in range(200):
        mixed = shuffled(np.arange(200.0)[:, None], weights, 25, np.random.default_rng(seed))[:, 0]
        assert sorted(mixed) == drawn(weights, np.random.default_rng(seed).random(), 25).tolist()
        correlations.append(stats.spearmanr(mixed, np.arange(25)).statistic)
    assert abs(np.mean(correlations)) < 4.0 / np.sqrt(200 * 24)


def test_roughening_adds_the_variance_that_its_docstring_says():
    n, spread, strength = 40_000, np.array([2.0, 0.5]), 3.0
    added = np.zeros((n, 2))
    roughen(added, np.diag(spread**2), strength, np.random.default_rng(6).standard_normal((n, 2)))
    assert added.std(axis=0) == pytest.approx(strength * spread * n**-0.5, rel=0.02)
    assert stats.kstest(added[:, 0] / (strength * 2.0 * n**-0.5), "norm").pvalue > 1e-3


def test_resampled_particles_are_the_systematic_draws_roughened():
    rng = np.random.default_rng(7)
    particles, weights, normal = rng.normal(size=(60, 4)), rng.dirichlet(np.ones(60)), rng.normal(size=(60, 4))
    before, covariance = particles.copy(), np.cov(particles.T)
    resampled = resample(particles, weights, 0.3, covariance, 1.5, normal)
    scale = 1.5 * 60 ** (-1 / 4) * np.sqrt(np.diagonal(covariance))
    assert resampled == pytest.approx(before[drawn(weights, 0.3)] + scale * normal, rel=1e-14)
    assert np.array_equal(particles, before)


LIKELIHOODS = arrays(float, st.tuples(st.integers(1, 3), st.integers(1, 30)), elements=st.floats(1e-9, 1e9))


def test_bayes_rule_gives_the_exact_shares():
    posterior, expected = reweigh(np.array([0.25, 0.75]), np.array([[3.0, 1.0], [2.0, 4.0]]))
    assert posterior == pytest.approx([1 / 3, 2 / 3], rel=1e-15)
    assert expected == pytest.approx([1.5, 3.5], rel=1e-15)


@given(LIKELIHOODS, st.floats(1e-6, 1e6))
def test_a_common_factor_changes_no_weight_and_the_order_of_the_channels_neither(likelihoods, scale):
    prior = np.random.default_rng(0).dirichlet(np.ones(likelihoods.shape[1]))
    posterior, expected = reweigh(prior, likelihoods)
    product = prior * np.prod(likelihoods, axis=0)
    assert posterior == pytest.approx(product / product.sum(), rel=1e-9)
    assert expected == pytest.approx((prior * likelihoods).sum(axis=1), rel=1e-9)
    scaled, scaled_expected = reweigh(prior, np.ascontiguousarray(scale * likelihoods[::-1]))
    assert scaled == pytest.approx(posterior, rel=1e-9)
    assert scaled_expected == pytest.approx(scale * expected[::-1], rel=1e-9)


def test_where_every_product_underflows_the_posterior_is_uniform():
    posterior, _ = reweigh(np.full(4, 0.25), np.full((2, 4), 1e-200))
    assert posterior.tolist() == [0.25] * 4


@pytest.mark.parametrize(
    ("weights", "size"),
    [([0.25] * 4, 4.0), ([0, 1, 0], 1.0), ([0.5, 0.5, 0, 0], 2.0), ([0.5, 0.25, 0.25], 8 / 3), ([2, 1, 1], 8 / 3)],
)
def test_effective_sample_size_of_exact_cases(weights, size):
    assert ess(np.array(weights, float)) == pytest.approx(size, rel=1e-15)


def test_moments_of_headings_are_circular():
    rng = np.random.default_rng(2)
    particles, weights = 4.0 * rng.normal(size=(30, 3)), rng.dirichlet(np.ones(30))
    mean, covariance = weighted_moments(particles, weights, 2)
    assert wrap(mean[2] - circular_mean(particles[:, 2], weights)) == pytest.approx(0.0, abs=1e-12)
    deviation = particles - mean
    deviation[:, 2] = wrap(deviation[:, 2])
    assert covariance == pytest.approx((weights * deviation.T) @ deviation, abs=1e-13)
