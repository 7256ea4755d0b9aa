"""The Gaussian kernel between numbers, k(x, y) = exp(-(x - y)^2 / (2 sigma^2)), and its MMD without Gram matrices.

It has the features phi_p(u) = exp(-u^2 / 2) u^p / sqrt(p!), p = 0, 1, 2, ... of u = x / sigma, so that with m_p(X) =
sum_i phi_p(u_i) / n

    MMD^2(X, Y) = sum_{p>=0} (m_p(X) - m_p(Y))^2,

O(n P) for P terms; a point mass at 0 has m_0 = 1 and else 0. phi_p(u)^2 is the Poisson distribution of mean u^2: the
sum ends where what is left of the largest u's distribution is below TOLERANCE. A safe sample has u = 0 and adds to m_0
alone. The largest u decides P, so u counts as FARTHEST at most: as far from 0 as a kernel can tell to 1e-13, and P
stays below 150.
"""

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, kernel
from mjnav.messages import Array

FARTHEST = 8.0  # bandwidths, beyond which samples are not told apart
TOLERANCE = 1e-10  # of the terms left out, as a share of k(x, x) = 1


def gaussian_mmd_squared(samples: Array, num: int, bandwidth: float) -> Array:
    """MMD^2 of each column's max(0, h) from a point mass at 0, Gaussian kernel: (K,).

    `samples` (s, K) are those of `num` samples that may exceed 0; the other num - s are taken as safe.
    """
    out, (u, feature) = np.empty(samples.shape[1]), np.empty((2, len(samples)))
    _gaussian_mmd_squared(out, np.ascontiguousarray(samples), num, 1.0 / bandwidth, u, feature)
    return out


@kernel
def _gaussian_mmd_squared(out: Vector, samples: Matrix, num: int, per_unit: float, u: Vector, feature: Vector):
    for k in range(out.size):
        count = 0  # of unsafe samples, whose x / sigma stand first in u
        for i in range(samples.shape[0]):
            u[count] = samples[i, k] * per_unit
            count += samples[i, k] > 0.0
        largest, lost = 0.0, 0.0  # lost: what the unsafe samples lack in m_0
        for i in range(count):
            u[i] = min(u[i], FARTHEST)
            largest = max(largest, u[i])
            feature[i] = np.exp(-0.5 * u[i] * u[i])
            lost += 1.0 - feature[i]
        squares = (lost / num) ** 2
        # The Poisson probabilities of mean largest^2: from p = 2 largest^2 on, each is at most half of the one before.
        mean = largest * largest
        probability, p = np.exp(-mean), 0
        while largest > 0.0 and (p < 2.0 * mean or probability > TOLERANCE):
            p += 1
            probability *= mean / p
            per_root, total = 1.0 / np.sqrt(p), 0.0
            for i in range(count):
                feature[i] *= u[i] * per_root
                total += feature[i]
            squares += (total / num) ** 2
        out[k] = squares
