import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.filters.weights import ess, normalise, weighted_moments

LOG_WEIGHTS = arrays(float, st.integers(1, 30), elements=st.floats(-800.0, 800.0))


def test_normalised_weights_are_the_exact_shares():
    weights, log_sum = normalise(np.log([1.0, 3.0]))
    assert weights == pytest.approx([0.25, 0.75], rel=1e-15)
    assert log_sum == pytest.approx(np.log(4.0), rel=1e-15)


@given(LOG_WEIGHTS, st.floats(-1e4, 1e4))
def test_a_common_factor_of_any_size_changes_no_weight(log_weights, shift):
    weights, log_sum = normalise(log_weights)
    shifted, shifted_sum = normalise(log_weights + shift)
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    assert shifted == pytest.approx(weights, abs=1e-9)
    assert shifted_sum == pytest.approx(log_sum + shift, abs=1e-8)


def test_an_impossible_particle_weighs_nothing_and_if_all_are_impossible_they_weigh_the_same():
    weights, log_sum = normalise([[0.0, -np.inf], [-np.inf, -np.inf]])
    assert weights.tolist() == [[1.0, 0.0], [0.5, 0.5]]
    assert log_sum.tolist() == [0.0, -np.inf]


@pytest.mark.parametrize(
    ("weights", "size"),
    [([0.25] * 4, 4.0), ([0, 1, 0], 1.0), ([0.5, 0.5, 0, 0], 2.0), ([0.5, 0.25, 0.25], 8 / 3), ([2, 1, 1], 8 / 3)],
)
def test_effective_sample_size_of_exact_cases(weights, size):
    assert ess(weights) == pytest.approx(size, rel=1e-15)


@given(LOG_WEIGHTS)
def test_effective_sample_size_lies_between_one_and_the_number_of_particles(log_weights):
    size = ess(normalise(log_weights)[0])
    assert 1.0 - 1e-9 <= size <= log_weights.size + 1e-9


def test_moments_are_those_that_numpy_computes():
    rng = np.random.default_rng(1)
    particles, weights = rng.normal(size=(40, 3)), normalise(rng.normal(size=40))[0]
    mean, covariance = weighted_moments(particles, weights)
    assert mean == pytest.approx(np.average(particles, axis=0, weights=weights), abs=1e-14)
    assert covariance == pytest.approx(np.cov(particles.T, aweights=weights, ddof=0), abs=1e-14)


def test_filters_side_by_side_have_the_moments_of_each_alone():
    rng = np.random.default_rng(2)
    particles, weights = rng.normal(size=(5, 20, 3)), normalise(rng.normal(size=(5, 20)))[0]
    mean, covariance = weighted_moments(particles, weights, heading=2)
    for b in range(5):
        one_mean, one_covariance = weighted_moments(particles[b], weights[b], heading=2)
        assert mean[b] == pytest.approx(one_mean, abs=1e-14)
        assert covariance[b] == pytest.approx(one_covariance, abs=1e-14)


def test_headings_on_both_sides_of_pi_have_their_mean_at_pi_and_a_small_variance():
    particles = np.array([[0.0, 0.0, np.pi - 0.1], [1.0, 0.0, -np.pi + 0.1]])
    mean, covariance = weighted_moments(particles, [0.5, 0.5], heading=2)
    assert abs(mean[2]) == pytest.approx(np.pi, abs=1e-12)
    assert covariance[2, 2] == pytest.approx(0.01, abs=1e-12)
    assert covariance[0, 2] == pytest.approx(0.05, abs=1e-12)
