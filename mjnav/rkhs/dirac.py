"""Distance (MMD) of the distribution of violations from a point mass at 0, "nothing comes near", or from a reference.

With x_i = max(0, h_i), i = 1 ... n, of weight 1/n each, and the embedding k(0, .) of the point mass, MMD is

    MMD^2 = sum_ij k(x_i, x_j) / n^2 - 2 sum_i k(x_i, 0) / n + k(0, 0).

It is 0 where no sample violates, and only there. Under the polynomial kernel (scale x y + offset)^d the point mass has
all raw moments 0 (`rkhs/mmd.py`), so with mu_p those of x

    MMD = sqrt(sum_{p=1..d} C(d, p) scale^p offset^(d-p) mu_p^2).

Sources: Gupta, Singh & Krishna (2022); Sharma & Singh (2024, "MMD-OPT", arXiv 2412.09121), with a Gaussian kernel.

A reference need not be free of violations: it is a plan that is taken as safe. Nair et al. (arXiv 2112.13034) match a
control's distribution with a desired one. With the point mass at 0 as reference this is `distance_from_dirac`; with
another, a plan is charged for being safer than the reference, too. Weights are 1/n.
"""

from typing import TYPE_CHECKING

import numpy as np

from mjnav.messages import Array
from mjnav.rkhs.gaussian import GaussianKernel, gaussian_mmd_squared
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


def distance_from_reference(h: Array, reference: Array, kernel: PolynomialKernel | GaussianKernel) -> Array:
    """MMD, not squared, of each row's max(0, h) from max(0, reference), for h (K, S) and reference (n,): (K,)."""
    if isinstance(kernel, GaussianKernel):
        return np.sqrt(gaussian_mmd_squared(h.T, h.shape[1], kernel.bandwidth, reference))
    found, desired = (raw_moments(np.maximum(x, 0.0), kernel.degree) for x in (h, reference))
    return np.sqrt(moment_distance(found, desired, kernel))
