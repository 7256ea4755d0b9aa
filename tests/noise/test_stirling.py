import numpy as np
import pytest
from scipy.special import loggamma

from mjnav.noise.pearson_iv import complex_log1p, stirling_remainder


@pytest.mark.parametrize("z", [0.01, 0.5, 1.0, 2.5, 11.9, 40.0, 2.5 + 7j, 3.0 - 0.1j, 4.0 + 60j])
def test_stirlings_formula_with_its_remainder_is_the_log_of_the_gamma_function(z):
    leading = (z - 0.5) * np.log(z) - z + 0.5 * np.log(2 * np.pi)
    assert stirling_remainder(z) == pytest.approx(np.real(loggamma(z) - leading), abs=3e-14)


def test_complex_log1p_keeps_the_digits_of_a_small_argument():
    u = 1e-12 + 1e-13j
    assert complex_log1p(u) == pytest.approx(u - u * u / 2, rel=1e-15)
    assert complex_log1p(1 - 2j) == pytest.approx(np.log(2 - 2j), rel=1e-15)
