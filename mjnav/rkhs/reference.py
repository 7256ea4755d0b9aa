"""The distance of distributions from a reference that need not be free of violations: a plan that is taken as safe.

Nair et al. (arXiv 2112.13034) match a control's distribution with a desired one. With the point mass at 0 as reference
this is `rkhs/dirac.py`; with another, a plan is charged for being safer than the reference, too. Weights are 1/n.
"""

import numpy as np

from mjnav.messages import Array
from mjnav.rkhs.gaussian import GaussianKernel, gaussian_mmd_squared
from mjnav.rkhs.mmd import PolynomialKernel, moment_distance, raw_moments


def distance_from_reference(h: Array, reference: Array, kernel: PolynomialKernel | GaussianKernel) -> Array:
    """MMD, not squared, of each row's max(0, h) from max(0, reference), for h (K, S) and reference (n,): (K,)."""
    if isinstance(kernel, GaussianKernel):
        return np.sqrt(gaussian_mmd_squared(h.T, h.shape[1], kernel.bandwidth, reference))
    found, desired = (raw_moments(np.maximum(x, 0.0), kernel.degree) for x in (h, reference))
    return np.sqrt(moment_distance(found, desired, kernel))
