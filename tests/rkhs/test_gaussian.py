import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.rkhs.gaussian import FARTHEST, gaussian_mmd_squared
from mjnav.rkhs.mmd import PolynomialKernel, distance_from_dirac

ROWS = arrays(float, st.tuples(st.just(3), st.integers(1, 12)), elements=st.floats(-2.0, 1.0))


def gram_mmd_squared(h, k):
    """MMD^2 of max(0, h) to a point mass at 0 by the definition's Gram matrices."""
    x, zero = np.maximum(np.asarray(h), 0.0), np.zeros(1)
    alpha = np.full(len(x), 1.0 / len(x))
    return float(alpha @ k(x, x) @ alpha - 2.0 * alpha @ k(x, zero)[:, 0] + k(zero, zero)[0, 0])


def gaussian_distance(h, bandwidth):
    return np.sqrt(gaussian_mmd_squared(h.T, h.shape[1], bandwidth))


def gaussian(bandwidth):
    return lambda a, b: np.exp(-((a[:, None] - b[None, :]) ** 2) / (2.0 * bandwidth**2))


@given(ROWS, st.integers(1, 5), st.floats(0.1, 3.0), st.floats(0.1, 3.0))
def test_a_polynomial_kernels_distance_is_that_of_gram_matrices(h, degree, scale, offset):
    found = distance_from_dirac(h, PolynomialKernel(degree, scale, offset))
    expected = [gram_mmd_squared(row, lambda a, b: (scale * np.outer(a, b) + offset) ** degree) for row in h]
    assert found**2 == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9 * (scale + offset) ** degree)


@given(ROWS, st.floats(0.001, 5.0))
def test_a_gaussian_kernels_distance_is_that_of_gram_matrices_up_to_eight_bandwidths(h, bandwidth):
    capped = np.minimum(h, FARTHEST * bandwidth)
    expected = np.array([gram_mmd_squared(row, gaussian(bandwidth)) for row in capped])
    assert gaussian_distance(h, bandwidth) ** 2 == pytest.approx(expected, rel=0.0, abs=1e-9)


@pytest.mark.parametrize(
    "distance", [lambda h: distance_from_dirac(h, PolynomialKernel(2)), lambda h: gaussian_distance(h, 0.3)]
)
@given(h=ROWS)
def test_it_is_zero_where_all_samples_are_safe_and_only_there(distance, h):
    assert distance(np.minimum(h, 0.0)).tolist() == [0.0] * 3
    h[:, 0] = 0.01
    assert (distance(h) > 0.0).all()


@pytest.mark.parametrize("x", [1e-6, 1e-3, 0.1, 0.7, 1.0, 3.0])
@pytest.mark.parametrize("share", [1.0, 0.04])
def test_for_equal_collisions_it_is_known_exactly_however_small(x, share):
    # K_xx = p^2 + 2 p (1 - p) k + (1 - p)^2, k(x, 0) = k: what is left is 2 p^2 (1 - k).
    h = np.where(np.arange(25) < 25 * share, x, -1.0)[None]
    expected = np.sqrt(2.0 * share**2 * -np.expm1(-(x**2) / (2.0 * 0.5**2)))
    assert gaussian_distance(h, 0.5)[0] == pytest.approx(expected, rel=1e-8)
