"""Systematic resampling, seeded, and roughening against the depletion that it brings."""

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Indices, Matrix, Vector
from mjnav.messages import Array


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
