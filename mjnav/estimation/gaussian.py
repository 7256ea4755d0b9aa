"""Gaussians of noise and of beliefs, for the filters that take everything for one."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.linalg import LinAlgError, cholesky, eigh

from mjnav.estimation.likelihood import widened
from mjnav.messages import Array
from mjnav.noise import Distribution


def noise_moments(noise: Mapping[str, Distribution], channels: Sequence[str]) -> tuple[Array, Array]:
    """Means (c,) and diagonal covariance (c, c) of the channels, none narrower than a filter's least std."""
    widened_noise = [widened(channel, noise[channel]) for channel in channels]
    return np.array([n.mean for n in widened_noise]), np.diag([n.std**2 for n in widened_noise])


def draw_gaussian(mean: Array, covariance: Array, num: int, rng: np.random.Generator) -> Array:
    """Draws from N(mean, covariance), (num, d)."""
    return mean + rng.standard_normal((num, mean.size)) @ root(covariance)


def root(covariance: Array) -> Array:
    """R with R^T R = covariance (d, d), upper triangular where rounding has left it positive definite.

    Of the widest noises it does not: then R is the root of the nearest matrix that is semidefinite.
    """
    try:
        return np.asarray(cholesky(covariance), float).T
    except LinAlgError:
        values, vectors = eigh(symmetrised(covariance))
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)), float).T


def symmetrised(matrix: Array) -> Array:
    """The symmetric part of a matrix (d, d), without the asymmetry that rounding leaves."""
    return 0.5 * (matrix + matrix.T)
