"""Raw moments of weighted samples, and the distance that they give."""

import numpy as np

from mjnav.messages import Array


def raw_moments(x: Array, degree: int, weights: Array | None = None) -> Array:
    """sum_i w_i x_i^p for p = 0 ... degree, (..., degree + 1), of x (..., n); w_i is 1/n by default."""
    moments = np.empty((*x.shape[:-1], degree + 1))
    power = np.ones_like(x)
    for p in range(degree + 1):
        moments[..., p] = power.mean(axis=-1) if weights is None else power @ weights
        power = power * x
    return moments


def moment_distance(x: Array, y: Array, coefficients: Array) -> Array:
    """sum_p c_p (x_p - y_p)^2 over the last axis of the moments x and y; coefficients (P,)."""
    difference = x - y
    return (difference * difference) @ coefficients
