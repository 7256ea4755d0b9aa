import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.rkhs.dirac import distance_from_dirac
from mjnav.rkhs.gaussian import FARTHEST, GaussianKernel
from mjnav.rkhs.mmd import PolynomialKernel, mmd_squared_gram
from mjnav.rkhs.reference import distance_from_reference

ROWS = arrays(float, st.tuples(st.just(3), st.integers(1, 12)), elements=st.floats(-2.0, 1.0))
ROW = arrays(float, st.integers(1, 8), elements=st.floats(-2.0, 1.0))
KERNELS = [PolynomialKernel(1), PolynomialKernel(3, 0.5, 2.0), GaussianKernel(0.3), GaussianKernel(5.0)]


def gram_mmd_squared(x, y, bandwidth):
    def k(a, b):
        return np.exp(-((a[:, None] - b[None, :]) ** 2) / (2.0 * bandwidth**2))

    return k(x, x).mean() - 2.0 * k(x, y).mean() + k(y, y).mean()


@given(ROWS, ROW, st.floats(0.001, 5.0))
def test_a_gaussian_kernels_distance_is_that_of_gram_matrices_up_to_eight_bandwidths(h, reference, bandwidth):
    x, y = (np.clip(values, 0.0, FARTHEST * bandwidth) for values in (h, reference))
    expected = np.array([gram_mmd_squared(row, y, bandwidth) for row in x])
    found = distance_from_reference(h, reference, GaussianKernel(bandwidth))
    assert found**2 == pytest.approx(expected, rel=0.0, abs=1e-9)


@given(ROWS, ROW, st.integers(1, 4))
def test_a_polynomial_kernels_distance_is_that_of_gram_matrices(h, reference, degree):
    expected = [mmd_squared_gram(np.maximum(row, 0.0), np.maximum(reference, 0.0), degree=degree) for row in h]
    found = distance_from_reference(h, reference, PolynomialKernel(degree))
    assert found**2 == pytest.approx(np.array(expected), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("kernel", KERNELS)
@given(h=ROWS)
def test_from_a_point_mass_at_zero_it_is_the_distance_from_there_to_the_last_bit(kernel, h):
    for reference in (np.zeros(1), np.full(5, -1.0)):
        assert distance_from_reference(h, reference, kernel).tolist() == distance_from_dirac(h, kernel).tolist()


@pytest.mark.parametrize("kernel", KERNELS)
def test_it_is_zero_for_the_same_values_in_another_order_and_for_no_others(kernel):
    h = np.array([[0.0, 0.5, 2.0, 0.0], [0.5, 0.0, 0.0, 2.0], [0.5, 0.0, 0.0, 1.9], [0.0, 0.0, 0.0, 0.0]])
    found = distance_from_reference(h, h[0], kernel)
    assert found[:2] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert (found[2:] > 1e-3).all()
