"""The Gram matrix of joint samples under the Gaussian kernel k(x, y) = exp(-|x - y|^2 / (2 sigma^2)).

A joint sample is a vector of coordinates of unlike units ([m], [rad], [m/s]): each coordinate is standardised, so that
all of them count the same in |x - y|. sigma is taken from the samples: the median of the distances of all pairs, the
"median heuristic" (Gretton et al. 2012, "A Kernel Two-Sample Test", section 8), times a factor.
"""

import numpy as np

from mjnav.geometry.compiled import Matrix, Vector, kernel
from mjnav.messages import Array


def joint_gram(samples: Array, bandwidth: float = 1.0) -> Array:
    """K_ij = k(x_i, x_j) of joint samples (S, D), standardised: (S, S), ones on the diagonal.

    `bandwidth` is sigma as a multiple of the median distance. Where more than half of all pairs coincide, so that the
    median is 0, the root mean square of the distances takes its place. Samples that are all the same make K all ones.
    """
    x = standardised(samples)
    num = len(x)
    squared = np.empty(num * (num - 1) // 2)
    _squared_distances(squared, x)
    gram = np.ones((num, num))
    scale = _median(squared) or (float(squared.mean()) if squared.size else 0.0)
    if scale > 0.0:
        _fill(gram, np.exp(squared * (-0.5 / (scale * bandwidth * bandwidth))))
    return gram


def standardised(samples: Array) -> Array:
    """Samples (S, D) with mean 0 and standard deviation 1 in each coordinate; one that does not vary becomes 0."""
    centred = np.asarray(samples, float) - np.mean(samples, axis=0)
    deviation = np.sqrt((centred * centred).mean(axis=0))
    varies = deviation > 1e-12 * np.abs(samples).max(axis=0, initial=0.0)
    return np.ascontiguousarray(centred * np.where(varies, 1.0 / np.where(varies, deviation, 1.0), 0.0))


def _median(squared: Array) -> float:
    """The upper median; 0 of none. Distances and their squares have it in the same pair."""
    middle = squared.size // 2
    return float(np.partition(squared, middle)[middle]) if squared.size else 0.0


@kernel
def _squared_distances(out: Vector, x: Matrix):
    """|x_i - x_j|^2 for i < j, the pairs of i = 0 first."""
    pair = 0
    for i in range(x.shape[0]):
        for j in range(i + 1, x.shape[0]):
            total = 0.0
            for d in range(x.shape[1]):
                total += (x[i, d] - x[j, d]) ** 2
            out[pair] = total
            pair += 1


@kernel
def _fill(gram: Matrix, pairs: Vector):
    """Both triangles from the pairs' values, in the order of `_squared_distances`."""
    pair = 0
    for i in range(gram.shape[0]):
        for j in range(i + 1, gram.shape[0]):
            gram[i, j] = pairs[pair]
            gram[j, i] = pairs[pair]
            pair += 1
