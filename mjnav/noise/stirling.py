"""The gamma function where its argument is large: what Stirling's formula leaves over.

Normalising constants of densities are ratios of gamma functions. Near a boundary between two Pearson types their
arguments grow without bound, and a difference of log gammas loses all its digits; Stirling's leading terms cancel on
paper, and only remainders, which are small, are left to compute.
"""

import cmath
from math import atan2, log1p

# B_2k / (2k (2k - 1)) for k = 1 .. 5, with Bernoulli's numbers; Abramowitz & Stegun 6.1.40.
_SERIES = (1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188)
_LARGE = 12.0  # from this modulus on the first term left out is below 3e-15


def complex_log1p(u: complex) -> complex:
    """log(1 + u), exact also for small u."""
    return complex(0.5 * log1p(2.0 * u.real + abs(u) ** 2), atan2(u.imag, 1.0 + u.real))


def stirling_remainder(z: complex) -> float:
    """Re R(z), where log Gamma(z) = (z - 1/2) log z - z + log(2 pi)/2 + R(z), for Re z > 0.

    R(z) = R(z + 1) + (z + 1/2) log(1 + 1/z) - 1 leads to a modulus for which the asymptotic series is exact.
    """
    remainder = 0j
    while abs(z) < _LARGE:
        remainder += (z + 0.5) * cmath.log(1.0 + 1.0 / z) - 1.0
        z += 1.0
    return (remainder + sum(c / z ** (2 * k + 1) for k, c in enumerate(_SERIES))).real
