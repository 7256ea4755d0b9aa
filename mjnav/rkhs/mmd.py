"""The maximum mean discrepancy: the distance between two distributions' mean embeddings.

A distribution X with samples x_i and weights alpha_i has the embedding mu_X = sum_i alpha_i k(x_i, .), and

    MMD^2(X, Y) = |mu_X - mu_Y|^2 = alpha' K_xx alpha - 2 alpha' K_xy beta + beta' K_yy beta.

For the polynomial kernel of degree d the feature map is finite, so the same number is

    MMD^2(X, Y) = sum_{p=0..d} C(d, p) scale^p offset^(d-p) (sum_i alpha_i x_i^p - sum_j beta_j y_j^p)^2,

O(n d) in place of O(n^2). See Nair et al., "Non Holonomic Collision Avoidance under Non-Parametric Uncertainty: A
Hilbert Space Approach" (arXiv 2112.13034), and Gretton et al. (2012), "A Kernel Two-Sample Test".
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.rkhs.kernels import PolynomialKernel
from mjnav.rkhs.moments import moment_distance, raw_moments


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
    """MMD^2 of samples x (n,) and y (m,) under the polynomial kernel, by moments; weights are 1/n and 1/m by default.

    Raises InvalidValue for samples or weights that are empty, not one-dimensional, not finite or of unequal length,
    and for a kernel that is none.
    """
    kernel = PolynomialKernel(degree, scale, offset)
    x, alpha = _checked("x", x, x_weights)
    y, beta = _checked("y", y, y_weights)
    return float(
        moment_distance(raw_moments(x, degree, alpha), raw_moments(y, degree, beta), kernel.coefficients),
    )


def mmd_squared_gram(
    x: ArrayLike,
    y: ArrayLike,
    *,
    degree: int,
    scale: float = 1.0,
    offset: float = 1.0,
    x_weights: ArrayLike | None = None,
    y_weights: ArrayLike | None = None,
) -> float:
    """The same number by Gram matrices, as the definition has it: the reference for `mmd_squared`."""
    kernel = PolynomialKernel(degree, scale, offset)
    x, alpha = _checked("x", x, x_weights)
    y, beta = _checked("y", y, y_weights)
    return float(
        alpha @ kernel.gram(x, x) @ alpha - 2.0 * alpha @ kernel.gram(x, y) @ beta + beta @ kernel.gram(y, y) @ beta
    )


def _checked(name: str, samples: ArrayLike, weights: ArrayLike | None) -> tuple[Array, Array]:
    samples = np.asarray(samples, float)
    if samples.ndim != 1 or samples.size == 0 or not np.isfinite(samples).all():
        raise InvalidValue(name, samples, "a non-empty one-dimensional array of finite numbers")
    if weights is None:
        return samples, np.full(samples.size, 1.0 / samples.size)
    weights = np.asarray(weights, float)
    if weights.shape != samples.shape or not np.isfinite(weights).all():
        raise InvalidValue(f"{name}_weights", weights, f"{samples.size} finite numbers, one for each of {name}")
    return samples, weights
