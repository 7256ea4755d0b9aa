"""Weights of particles: Bayes' rule, effective sample size, weighted moments.

Compiled, for B filters side by side: particles are (B, n, d), weights (B, n) and sum to one.
"""

from math import atan2, cos, sin

import numpy as np

from mjnav.geometry.compiled import kernel
from mjnav.geometry.heading import wrapped
from mjnav.geometry.kernel_types import Cube, Matrix


@kernel
def reweigh(weights: Matrix, likelihoods: Cube):
    """Bayes' rule, w_i prod_c l_ci / sum: the posterior (B, n), and sum_i w_i l_ci of each factor, (C, B).

    `likelihoods` (C, B, n) are positive. Where every product underflows the posterior is uniform.
    """
    num_factors, num_filters, n = likelihoods.shape
    posterior, expected = np.empty((num_filters, n)), np.empty((num_factors, num_filters))
    for b in range(num_filters):
        for i in range(n):
            posterior[b, i] = weights[b, i]
        for c in range(num_factors):
            mean = 0.0
            for i in range(n):
                mean += weights[b, i] * likelihoods[c, b, i]
                posterior[b, i] *= likelihoods[c, b, i]
            expected[c, b] = mean
        total = 0.0
        for i in range(n):
            total += posterior[b, i]
        for i in range(n):
            posterior[b, i] = posterior[b, i] / total if total > 0.0 else 1.0 / n
    return posterior, expected


@kernel
def ess(weights: Matrix):
    """Effective sample size (sum w)^2 / sum w^2 (Kong, Liu & Wong 1994), (B,): from 1 to n."""
    size = np.empty(len(weights))
    for b in range(len(weights)):
        total, squares = 0.0, 0.0
        for w in weights[b]:
            total += w
            squares += w * w
        size[b] = total * total / squares
    return size


@kernel
def weighted_moments(particles: Cube, weights: Matrix, heading: int = -1):
    """Mean (B, d) and covariance sum_i w_i e_i e_i^T (B, d, d).

    Column `heading` is an angle [rad]: its mean is the direction of the mean unit vector, its deviations are wrapped.
    """
    num_filters, n, d = particles.shape
    mean, covariance = np.empty((num_filters, d)), np.empty((num_filters, d, d))
    e, weighted = np.empty((d, n)), np.empty(n)  # a row a column of the particles: long inner loops
    for b in range(num_filters):
        w = weights[b]
        for j in range(d):
            row = e[j]
            for i in range(n):
                row[i] = particles[b, i, j]
            if j == heading:
                mean[b, j] = _direction(row, w)
                for i in range(n):
                    row[i] = wrapped(row[i] - mean[b, j])
            else:
                centre = 0.0
                for i in range(n):
                    centre += w[i] * row[i]
                for i in range(n):
                    row[i] -= centre
                mean[b, j] = centre
        for j in range(d):
            for i in range(n):
                weighted[i] = w[i] * e[j, i]
            for k in range(j, d):
                total = 0.0
                for i in range(n):
                    total += weighted[i] * e[k, i]
                covariance[b, j, k] = covariance[b, k, j] = total
    return mean, covariance


@kernel
def _direction(angles, weights):
    """Of the weighted mean unit vector [rad]."""
    x, y = 0.0, 0.0
    for i in range(len(angles)):
        x += weights[i] * cos(angles[i])
        y += weights[i] * sin(angles[i])
    return atan2(y, x)
