"""The distance of a distribution from a point mass at 0: how far violations are from "nothing comes near".

With x_i = max(0, h_i), i = 1 ... n, of weight 1/n each, and the embedding k(0, .) of the point mass, MMD is

    MMD^2 = sum_ij k(x_i, x_j) / n^2 - 2 sum_i k(x_i, 0) / n + k(0, 0).

It is 0 where no sample violates, and only there. Under the polynomial kernel (scale x y + offset)^d the point mass has
all raw moments 0 (`rkhs/mmd.py`), so with mu_p those of x

    MMD = sqrt(sum_{p=1..d} C(d, p) scale^p offset^(d-p) mu_p^2).

Sources: Gupta, Singh & Krishna (2022); Sharma & Singh (2024, "MMD-OPT", arXiv 2412.09121), with a Gaussian kernel.
"""

from typing import TYPE_CHECKING

import numpy as np

from mjnav.messages import Array
from mjnav.rkhs.mmd import PolynomialKernel, moment_distance, raw_moments

if TYPE_CHECKING:
    from mjnav.rkhs.gaussian import GaussianKernel


def distance_from_dirac(h: Array, kernel: "PolynomialKernel | GaussianKernel") -> Array:
    """MMD, not squared, of each row's max(0, h) from a point mass at 0, for h (K, S): (K,)."""
    if isinstance(kernel, PolynomialKernel):
        moments = raw_moments(np.maximum(h, 0.0), kernel.degree)
        return np.sqrt(moment_distance(moments, np.zeros(kernel.degree), kernel))
    # Whoever has a GaussianKernel has this module: without one, its loop need not be compiled.
    from mjnav.rkhs.gaussian import gaussian_mmd_squared

    return np.sqrt(gaussian_mmd_squared(h.T, h.shape[1], kernel.bandwidth))
