"""Particle filter operations: Bayes' rule, effective sample size, weighted moments, systematic resampling, roughening.

Particles are (n, d), their weights (n,) sum to one. Resampling is seeded; roughening counters the depletion that it
brings.
"""

from math import atan2, cos, sin

import numpy as np

from mjnav.compile.compiled import Indices, Matrix, Vector, exact, kernel
from mjnav.geometry.angles import wrapped
from mjnav.messages import Array

# -------------------------------------------------------------------------------------------- weights


@kernel
def reweigh(weights: Vector, likelihoods: Matrix):
    """Bayes' rule, w_i prod_c l_ci / sum: the posterior (n,), and sum_i w_i l_ci of each factor, (C,).

    `likelihoods` (C, n) are positive. Where every product underflows the posterior is uniform.
    """
    num_factors, n = likelihoods.shape
    posterior, expected = weights.copy(), np.empty(num_factors)
    for c in range(num_factors):
        mean = 0.0
        for i in range(n):
            mean += weights[i] * likelihoods[c, i]
            posterior[i] *= likelihoods[c, i]
        expected[c] = mean
    total = 0.0
    for i in range(n):
        total += posterior[i]
    for i in range(n):
        posterior[i] = posterior[i] / total if total > 0.0 else 1.0 / n
    return posterior, expected


@kernel
def ess(weights: Vector):
    """Effective sample size (sum w)^2 / sum w^2 (Kong, Liu & Wong 1994): from 1 to n."""
    total, squares = 0.0, 0.0
    for w in weights:
        total += w
        squares += w * w
    return total * total / squares


@kernel
def weighted_moments(particles: Matrix, weights: Vector, heading: int):
    """Mean (d,) and covariance sum_i w_i e_i e_i^T (d, d) of particles (n, d).

    Column `heading` is an angle [rad], none where it is -1: its mean is the direction of the mean unit vector, its
    deviations are wrapped.
    """
    n, d = particles.shape
    mean, covariance = np.empty(d), np.empty((d, d))
    e, weighted = np.empty((d, n)), np.empty(n)  # a row a column of the particles: long inner loops
    for j in range(d):
        row = e[j]
        for i in range(n):
            row[i] = particles[i, j]
        if j == heading:
            mean[j] = _direction(row, weights)
            for i in range(n):
                row[i] = wrapped(row[i] - mean[j])
        else:
            centre = 0.0
            for i in range(n):
                centre += weights[i] * row[i]
            for i in range(n):
                row[i] -= centre
            mean[j] = centre
    for j in range(d):
        for i in range(n):
            weighted[i] = weights[i] * e[j, i]
        for k in range(j, d):
            total = 0.0
            for i in range(n):
                total += weighted[i] * e[k, i]
            covariance[j, k] = covariance[k, j] = total
    return mean, covariance


@kernel
def _direction(angles, weights):
    """Of the weighted mean unit vector [rad]."""
    x, y = 0.0, 0.0
    for i in range(len(angles)):
        x += weights[i] * cos(angles[i])
        y += weights[i] * sin(angles[i])
    return atan2(y, x)


# ----------------------------------------------------------------------------------------- resampling


@exact
def systematic(weights: Vector, offset: float, num: int):
    """Indices of the particles drawn, (num,), in rising order (Kitagawa 1996), for weights (n,) and offset in [0, 1).

    Draw i is the first particle whose cumulative weight exceeds (offset + i)/num of the total, so particle j comes
    floor(num w_j) or ceil(num w_j) times and num w_j times on average. The weights need a positive sum, not a
    particular one: a sum of 1 - 1e-16 loses no draw. A particle of weight zero is never drawn.
    """
    cumulative = np.cumsum(weights)
    total, last = cumulative[-1], len(weights) - 1
    while last > 0 and weights[last] == 0.0:  # rounding may carry a position to the total itself
        last -= 1
    indices = np.empty(num, np.intp)
    j = 0
    for i in range(num):
        position = total * ((offset + i) / num)
        while j < last and cumulative[j] <= position:
            j += 1
        indices[i] = j
    return indices


def shuffled(particles: Array, weights: Array, num: int, rng: np.random.Generator) -> Array:
    """Systematic draws from particles (n, d) in random order, (num, d).

    Systematic draws alone come sorted by particle, and neighbours share ancestors. Where row i of one body's draws
    meets row i of another's, that order would correlate bodies that are independent.
    """
    return _ordered(particles, weights, rng.random(), rng.permutation(num))


@exact
def _ordered(particles: Matrix, weights: Vector, offset: float, order: Indices):
    return particles[systematic(weights, offset, len(order))[order]]


@exact
def roughen(particles, covariance, strength, normal):
    """Adds to column j of the particles (n, d) K sqrt(covariance_jj) n^(-1/d) times draws `normal` (n, d) of N(0, 1).

    Gordon, Salmond & Smith (1993), section 4.2, with the standard deviation in place of the range, which grows with n.
    Copies of one particle part again; the variance grows by the factor 1 + K^2 n^(-2/d).
    """
    n, d = particles.shape
    for j in range(d):
        scale = strength * n ** (-1.0 / d) * np.sqrt(covariance[j, j])
        for i in range(n):
            particles[i, j] += scale * normal[i, j]


@exact
def resample(particles: Matrix, weights: Vector, offset: float, covariance: Matrix, strength: float, normal: Matrix):
    """Systematic draws from particles (n, d) by their weights (n,), roughened by `normal` (m, d): a new (m, d)."""
    drawn = particles[systematic(weights, offset, len(normal))]
    roughen(drawn, covariance, strength, normal)
    return drawn
