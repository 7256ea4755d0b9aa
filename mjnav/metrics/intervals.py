"""How sure a figure is: intervals for rates and means, and whether two methods differ."""

from math import sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue

MAX_SHARED = 200_000_000  # seeds drawn in all by a shared bootstrap: 0.8 GB


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


class SharedBootstrap:
    """Percentile bootstrap intervals of means over the same n seeds, drawn with replacement once for all figures.

    What a seed lacks (NaN) is left out of a resample's mean. Sharing the draws makes a table of thousands of figures
    quick: one product of matrices each.
    """

    def __init__(self, num: int, rng: np.random.Generator, *, resamples: int = 10_000):
        resamples = min(resamples, MAX_SHARED // max(num, 1))
        drawn = rng.integers(num, size=(resamples, num)) + num * np.arange(resamples)[:, None]
        counts = np.bincount(drawn.ravel(), minlength=resamples * num).reshape(resamples, num)
        self._counts = counts.astype(np.float32)  # (R, n) how often each seed was drawn
        self._signs = np.where(rng.integers(2, size=(resamples, num)), np.float32(1), np.float32(-1))

    def interval(self, values: ArrayLike, level: float = 0.95) -> tuple[float, float] | None:
        """Of the mean of values (n,); None where all are NaN."""
        values = np.asarray(values, float)
        known = np.isfinite(values)
        if not known.any():
            return None
        centre = float(values[known].mean())  # single precision is for what is left
        sums = self._counts @ np.where(known, values - centre, 0.0).astype(np.float32)
        sizes = self._counts @ known.astype(np.float32)
        means = sums[sizes > 0.0] / sizes[sizes > 0.0]
        low, high = np.quantile(means.astype(float), [0.5 - 0.5 * level, 0.5 + 0.5 * level]).tolist()
        return centre + low, centre + high

    def p_value(self, differences: ArrayLike) -> float | None:
        """Of the hypothesis that paired differences (n,) are as likely to be negative, by flipping signs at random.

        (1 + how often |mean of flipped| >= |mean|) / (1 + flips); None where all are NaN. Source: Good, Permutation,
        Parametric and Bootstrap Tests of Hypotheses, 3rd ed., 2005, section 3.2.
        """
        differences = np.asarray(differences, float)
        known = np.isfinite(differences)
        if not known.any():
            return None
        kept = np.where(known, differences, 0.0)
        scale = np.abs(kept).max() or 1.0
        flipped = self._signs @ (kept / scale).astype(np.float32)
        least = abs(kept.sum()) / scale * (1.0 - 1e-6)  # what is equal but for rounding counts
        return float((1 + (np.abs(flipped) >= least).sum()) / (1 + len(flipped)))


def mcnemar(only_a: int, only_b: int) -> float:
    """p-value of equal success rates from the pairs in which one method alone succeeded: the exact binomial test.

    Source: McNemar, Psychometrika 12 (1947) 153.
    """
    if only_a + only_b == 0:
        return 1.0
    from scipy.stats import binomtest

    return float(binomtest(only_a, only_a + only_b).pvalue)


def holm(p_values: ArrayLike) -> list[float]:
    """p-values (n,) adjusted for there being n of them: max over smaller ones of (n - rank) p, at most 1.

    Source: Holm, Scandinavian Journal of Statistics 6 (1979) 65.
    """
    p = np.asarray(p_values, float)
    order = np.argsort(p, kind="stable")
    adjusted = np.minimum(1.0, np.maximum.accumulate((len(p) - np.arange(len(p))) * p[order]))
    out = np.empty(len(p))
    out[order] = adjusted
    return out.tolist()
