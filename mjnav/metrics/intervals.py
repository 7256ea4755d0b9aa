"""How sure a figure is: intervals for rates and for differences between methods."""

from math import sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue


def wilson(successes: int, trials: int, level: float = 0.95) -> tuple[float, float] | None:
    """Wilson's score interval of a rate; None without trials.

    (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n) with p = successes/n and z the normal quantile.
    Source: Wilson, J. Am. Stat. Assoc. 22 (1927) 209. Raises InvalidValue where successes are not in [0, trials].
    """
    if not 0 <= successes <= trials:
        raise InvalidValue("successes", successes, f"a number from 0 to the {trials} trials")
    if trials == 0:
        return None
    z = NormalDist().inv_cdf(0.5 + 0.5 * level)
    rate = successes / trials
    centre = rate + z * z / (2 * trials)
    half = z * sqrt(rate * (1.0 - rate) / trials + z * z / (4 * trials * trials))
    scale = 1.0 + z * z / trials
    low = 0.0 if successes == 0 else (centre - half) / scale
    high = 1.0 if successes == trials else (centre + half) / scale
    return low, high


def paired_bootstrap(
    a: ArrayLike, b: ArrayLike, rng: np.random.Generator, *, level: float = 0.95, resamples: int = 10_000
) -> tuple[float, float] | None:
    """Percentile bootstrap interval of the mean of a - b, where a[i] and b[i] come from the same seed; each (n,).

    Pairs of which either is NaN do not count; None where none is left. Source: Efron & Tibshirani, An Introduction to
    the Bootstrap, 1993, chapter 13.
    """
    difference = np.asarray(a, float) - np.asarray(b, float)
    difference = difference[np.isfinite(difference)]
    if not difference.size:
        return None
    means = np.empty(resamples)
    block = max(1, 10_000_000 // difference.size)  # resamples at a time: 80 MB
    for first in range(0, resamples, block):
        count = min(block, resamples - first)
        means[first : first + count] = difference[rng.integers(difference.size, size=(count, difference.size))].mean(1)
    low, high = np.quantile(means, [0.5 - 0.5 * level, 0.5 + 0.5 * level]).tolist()
    return low, high
