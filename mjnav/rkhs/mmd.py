"""The maximum mean discrepancy: the distance between two distributions' embeddings.

A distribution X with samples x_i and weights alpha_i has the embedding mu_X = sum_i alpha_i k(x_i, .), and

    MMD^2(X, Y) = |mu_X - mu_Y|^2 = alpha' K_xx alpha - 2 alpha' K_xy beta + beta' K_yy beta.

The polynomial kernel k(x, y) = (scale x y + offset)^d has the finite feature map phi_p(x) = sqrt(c_p) x^p, p = 0 ... d,
with c_p = C(d, p) scale^p offset^(d-p). So the same number follows from the raw moments m_p(X) = sum_i alpha_i x_i^p,

    MMD^2(X, Y) = sum_{p=0..d} c_p (m_p(X) - m_p(Y))^2,

in O(n d) in place of O(n^2). Where both sets of weights sum to one, the term p = 0 vanishes: the controllers compare
the moments 1 ... d. Degree 1 sees means only, degree 2 variances too, degree 3 skew too.

Sources: Nair et al., "Non Holonomic Collision Avoidance under Non-Parametric Uncertainty: A Hilbert Space Approach"
(arXiv 2112.13034); Gretton et al. (2012), "A Kernel Two-Sample Test".
"""

from dataclasses import dataclass
from math import comb
from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, kernel
from mjnav.errors import InvalidValue
from mjnav.messages import LARGEST, Array, finite, number

LEAST, MOST = 1e-9, 1e6  # of scale and offset: to the tenth power, times samples to the twentieth, still a float


@dataclass(frozen=True, slots=True)
class PolynomialKernel:
    """k(x, y) = (scale x y + offset)^degree with scale > 0, offset > 0 and degree 1 to 10. Raises InvalidValue."""

    degree: int
    scale: float = 1.0
    offset: float = 1.0

    def __post_init__(self):
        if not isinstance(self.degree, Integral) or isinstance(self.degree, bool) or not 1 <= self.degree <= 10:
            raise InvalidValue("degree", self.degree, "a whole number from 1 to 10")
        for name in ("scale", "offset"):
            if not LEAST <= number(name, getattr(self, name)) <= MOST:
                raise InvalidValue(name, getattr(self, name), f"a finite number > 0, from {LEAST:g} to {MOST:g}")

    @property
    def coefficients(self) -> Array:
        """c_p for p = 0 ... degree, (degree + 1,)."""
        d = int(self.degree)
        return np.array([comb(d, p) * self.scale**p * self.offset ** (d - p) for p in range(d + 1)])


def raw_moments(x: Array, degree: int, weights: Array | None = None) -> Array:
    """m_p = sum_i w_i x_i^p for p = 1 ... degree, (..., degree), of samples x (..., n); w_i is 1/n by default."""
    if weights is not None:
        return np.moveaxis(np.cumprod([x] * degree, axis=0) @ weights, 0, -1)
    rows = np.ascontiguousarray(x, float).reshape(-1, x.shape[-1])
    return _mean_powers(rows, degree).reshape(*x.shape[:-1], degree)


@kernel
def _mean_powers(x: Matrix, degree: int):
    """The means of x^p for p = 1 ... degree, along each row of (K, n): (K, degree)."""
    means, power = np.empty((len(x), degree)), np.empty(x.shape[1])
    for k in range(len(x)):
        power[:] = 1.0
        for p in range(degree):
            total = 0.0
            for i in range(power.size):
                power[i] *= x[k, i]
                total += power[i]
            means[k, p] = total / power.size
    return means


def moment_distance(x: Array, y: Array, kernel: PolynomialKernel) -> Array:
    """MMD^2 = sum_{p=1..d} c_p (x_p - y_p)^2 of distributions with raw moments x and y (..., d), which broadcast."""
    difference = x - y
    return (difference * difference) @ kernel.coefficients[1:]


def distance_from_dirac(h: Array, kernel: PolynomialKernel) -> Array:
    """MMD, not squared, of each row's max(0, h) from a point mass at 0, for h (K, S): (K,).

    It is 0 where no sample violates, and only there: the point mass has all raw moments 0 (Gupta, Singh & Krishna 2022;
    Sharma & Singh 2024, "MMD-OPT", arXiv 2412.09121, with a Gaussian kernel: `rkhs/gaussian.py`).
    """
    moments = raw_moments(np.maximum(h, 0.0), kernel.degree)
    return np.sqrt(moment_distance(moments, np.zeros(kernel.degree), kernel))


def mmd_squared(
    x: ArrayLike,
    y: ArrayLike,
    *,
    degree: int,
    scale: float = 1.0,
    offset: float = 1.0,
    x_weights: ArrayLike | None = None,
    y_weights: ArrayLike | None = None,
) -> float:
    """MMD^2 of samples x (n,) and y (m,) by moments; the weights are 1/n and 1/m by default and need not sum to one.

    Raises InvalidValue for samples or weights that are empty, not one-dimensional, not finite, beyond LARGEST or of
    unequal length, and for a kernel that is none.
    """
    kernel = PolynomialKernel(degree, scale, offset)
    x, alpha = _checked("x", x, x_weights)
    y, beta = _checked("y", y, y_weights)
    of_order_zero = kernel.coefficients[0] * (alpha.sum() - beta.sum()) ** 2
    return float(of_order_zero + moment_distance(raw_moments(x, degree, alpha), raw_moments(y, degree, beta), kernel))


def _checked(name: str, samples: ArrayLike, weights: ArrayLike | None) -> tuple[Array, Array]:
    found = finite(name, samples, None, most=LARGEST)
    if weights is None:
        return found, np.full(found.size, 1.0 / found.size)
    return found, finite(f"{name}_weights", weights, found.size, most=LARGEST)
