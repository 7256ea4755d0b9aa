"""Systematic resampling, seeded, and roughening against the depletion that it brings."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjnav.messages import Array


def systematic(weights: ArrayLike, offset: float | np.random.Generator, num: int | None = None) -> NDArray[np.intp]:
    """Indices of the particles drawn, (num,), in rising order (Kitagawa 1996); num defaults to n.

    Draw i is the first particle whose cumulative weight exceeds (offset + i)/num of the total, offset in [0, 1), so
    particle j comes floor(num w_j) or ceil(num w_j) times and num w_j times on average. The weights (n,) need a
    positive sum and no particular one: a sum of 1 - 1e-16 loses no draw. A particle of weight zero is never drawn.
    """
    cumulative = np.cumsum(np.asarray(weights, float))
    num = cumulative.size if num is None else num
    u = offset.random() if isinstance(offset, np.random.Generator) else offset
    total = cumulative[-1]
    indices = np.searchsorted(cumulative, total * ((u + np.arange(num)) / num), side="right")
    # Rounding may carry the last position to the total itself: it belongs to the last particle that has weight.
    if num and indices[-1] == cumulative.size:
        indices = np.minimum(indices, np.searchsorted(cumulative, total))
    return indices


def shuffled(weights: ArrayLike, num: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Systematic draws in random order, (num,).

    Systematic draws alone come sorted by particle, and neighbours share ancestors. Where row i of one body's draws
    meets row i of another's, that order would correlate bodies that are independent.
    """
    return rng.permutation(systematic(weights, rng, num))


def roughen(particles: Array, spread: ArrayLike, strength: float, rng: np.random.Generator) -> Array:
    """The particles (n, d) with independent N(0, (K spread_j n^(-1/d))^2) added to column j.

    Gordon, Salmond & Smith (1993), section 4.2, with the standard deviation (d,) in place of the range, which grows
    with n. Copies of one particle part again; the variance grows by the factor 1 + K^2 n^(-2/d).
    """
    n, d = particles.shape
    scale = strength * n ** (-1.0 / d) * np.asarray(spread, float)
    return particles + scale * rng.standard_normal((n, d))
