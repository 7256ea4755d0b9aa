"""Weights of particles: normalisation, effective sample size, weighted moments.

Particles have shape (..., n, d), weights (..., n); leading axes are filters side by side.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.geometry.angles import wrap
from mjnav.messages import Array


def normalise(log_weights: ArrayLike) -> tuple[Array, Array]:
    """Weights that sum to one along the last axis, (..., n), and log sum_i exp(log_weights_i), (...).

    The largest is subtracted before the exponential (log-sum-exp), so no scale under- or overflows. Where every
    particle is impossible (all -inf) the weights are uniform and the sum is -inf.
    """
    log_weights = np.asarray(log_weights, float)
    largest = log_weights.max(axis=-1, keepdims=True)
    impossible = largest == -np.inf
    if impossible.any():
        log_weights = np.where(impossible, 0.0, log_weights)
        shift = np.where(impossible, 0.0, largest)
    else:
        shift = largest
    weights = np.exp(log_weights - shift)
    total = weights.sum(axis=-1, keepdims=True)
    log_sum = np.where(impossible, -np.inf, shift + np.log(total))
    return weights / total, log_sum[..., 0]


def ess(weights: ArrayLike) -> Array:
    """Effective sample size (sum w)^2 / sum w^2 along the last axis (Kong, Liu & Wong 1994): from 1 to n."""
    weights = np.asarray(weights, float)
    return weights.sum(axis=-1) ** 2 / np.einsum("...n,...n->...", weights, weights)


def weighted_moments(particles: ArrayLike, weights: ArrayLike, *, heading: int | None = None) -> tuple[Array, Array]:
    """Mean (..., d) and covariance sum_i w_i e_i e_i^T (..., d, d) under weights that sum to one.

    Column `heading` is an angle [rad]: its mean is the direction of the mean unit vector, its deviations are wrapped.
    """
    weights = np.asarray(weights, float)
    rows = np.ascontiguousarray(np.swapaxes(np.asarray(particles, float), -1, -2))  # (..., d, n): long inner loops
    column = weights[..., None]  # (..., n, 1)
    mean = (rows @ column)[..., 0]
    if heading is not None:
        angle = rows[..., heading, None, :]
        mean[..., heading] = np.arctan2(np.sin(angle) @ column, np.cos(angle) @ column)[..., 0, 0]
    deviation = rows - mean[..., None]
    if heading is not None:
        deviation[..., heading, :] = wrap(deviation[..., heading, :])
    return mean, (deviation * weights[..., None, :]) @ np.swapaxes(deviation, -1, -2)
