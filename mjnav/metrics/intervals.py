"""How sure a figure is: intervals for rates and means, and whether two methods differ."""

from math import sqrt
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue
from mjnav.messages import Array

Interval = tuple[float, float] | None

LEVEL = 0.95  # of every interval
DIGITS = 6  # of an interval's ends, of the largest value
MAX_SHARED = 200_000_000  # seeds drawn in all by a shared bootstrap: 0.8 GB


def wilson(successes: float, trials: float) -> tuple[float, float] | None:
    """Wilson's score interval of a rate; None without trials.

    (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n) with p = successes/n and z the normal quantile.
    Source: Wilson, J. Am. Stat. Assoc. 22 (1927) 209. Raises InvalidValue where successes are not in [0, trials].
    """
    if not 0 <= successes <= trials:
        raise InvalidValue("successes", successes, f"a number from 0 to the {trials} trials")
    if trials == 0:
        return None
    z = NormalDist().inv_cdf(0.5 + 0.5 * LEVEL)
    rate = successes / trials
    centre = rate + z * z / (2 * trials)
    half = z * sqrt(rate * (1.0 - rate) / trials + z * z / (4 * trials * trials))
    scale = 1.0 + z * z / trials
    low = 0.0 if successes == 0 else (centre - half) / scale
    high = 1.0 if successes == trials else (centre + half) / scale
    return low, high


def clustered_wilson(successes: ArrayLike, trials: ArrayLike) -> tuple[float, float] | None:
    """Wilson's interval of a rate from units of several trials that resemble one another; None without trials.

    `successes` and `trials` are of each unit, (m,). The trials count as n / d, where the design effect d >= 1 is the
    variance of the rate between units over that of independent trials: (sum_u (s_u - p t_u)^2 / n^2) / (p (1 - p) / n).
    Source: Rao & Scott, Biometrics 48 (1992) 577, without their factor m/(m - 1), so that one trial a unit gives
    Wilson's interval. For d alone, two units of the mean size are added, one of successes only and one of failures
    only: a rate of 0 or 1 says nothing of how alike a unit's trials are, and is then taken from m trials.
    """
    s, t = np.asarray(successes, float), np.asarray(trials, float)
    s, t = s[t > 0], t[t > 0]
    if not t.size:
        return None
    size = t.mean()
    of_unit, in_unit = np.append(s, [size, 0.0]), np.append(t, [size, size])
    num = in_unit.sum()
    p = of_unit.sum() / num
    effect = max(float(np.sum((of_unit - p * in_unit) ** 2) / (num * p * (1.0 - p))), 1.0)
    return wilson(float(s.sum()) / effect, float(t.sum()) / effect)


FEWEST = 8  # units of a studentised interval; the deviation of fewer says little


class SharedBootstrap:
    """Studentised bootstrap intervals of means over the same n units, drawn with replacement once for all figures.

    With m the mean, s its standard error and t_b = (m_b - m) / s_b those of resample b, the interval is m - s q, from
    the upper to the lower quantile q of t_b (Efron & Tibshirani, An Introduction to the Bootstrap, 1993, section 12.5).
    Where q is infinite, as in many resamples all values are alike, and below FEWEST units, its ends are the quantiles
    of m_b. No end is beyond all the units' values, as no mean is. What a unit lacks (NaN) is left out of a resample's
    mean. Sharing the draws makes a table of thousands of figures quick: a few products of matrices for many of them.
    """

    def __init__(self, num: int, rng: np.random.Generator, *, resamples: int = 10_000):
        resamples = min(resamples, MAX_SHARED // max(num, 1))
        drawn = rng.integers(num, size=(resamples, num)) + num * np.arange(resamples)[:, None]
        counts = np.bincount(drawn.ravel(), minlength=resamples * num).reshape(resamples, num)
        self._counts = counts.astype(np.float32)  # (R, n) how often each seed was drawn
        self._signs = np.where(rng.integers(2, size=(resamples, num)), np.float32(1), np.float32(-1))

    def interval(self, values: ArrayLike) -> Interval:
        """Of the mean of values (n,); None where all are NaN."""
        return self.intervals(np.asarray(values, float)[None])[0]

    def intervals(self, values: ArrayLike) -> list[Interval]:
        """Of the mean of each row of values (F, n)."""
        values = np.asarray(values, float)
        known = np.isfinite(values)
        return self.ratios(np.where(known, values, 0.0), known)

    def ratios(self, parts: ArrayLike, wholes: ArrayLike, *, studentised: bool = True) -> list[Interval]:
        """Of the sum of `parts` over the sum of `wholes`, of each row (F, n); None where no whole is above 0.

        Without `studentised` all ends are quantiles of m_b: of rates, whose s_b is coarse.

        With `wholes` that count, and `parts` that are sums, it is a mean over units of several values; with the costs
        of two methods it is the ratio of their means. Where a whole is 0, so must the part be.
        """
        parts, wholes = np.asarray(parts, float), np.asarray(wholes, float)
        defined = (wholes > 0.0).any(axis=1)
        found: list[Interval] = [None] * len(parts)
        if defined.any():
            low, high = self._quantiles(parts[defined], wholes[defined], FEWEST if studentised else np.inf)
            for row, *interval in zip(np.flatnonzero(defined), low.tolist(), high.tolist(), strict=True):
                found[row] = interval[0], interval[1]
        return found

    def _quantiles(self, parts: Array, wholes: Array, fewest: float) -> Array:
        """The ends of the intervals of rows that each have a whole, (2, F)."""
        total = wholes.sum(axis=1, keepdims=True)
        centre = parts.sum(axis=1, keepdims=True) / total
        # Differences below single precision, which is for what is left, are ignored.
        scale = np.max(np.abs(parts), axis=1, keepdims=True) / np.max(wholes, axis=1, keepdims=True)
        scale[scale == 0.0] = 1.0
        rest = (parts - centre * wholes) / scale
        error = np.sqrt((rest * rest).sum(axis=1)) / total[:, 0]
        size = self._sums(wholes)
        tails = [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL]
        with np.errstate(invalid="ignore", divide="ignore"):  # a resample may have drawn only units that lack the value
            moved = self._sums(rest) / size
            squares = self._sums(rest * rest) - 2.0 * moved * self._sums(rest * wholes)
            squares += moved * moved * self._sums(wholes * wholes)
            t = np.where(moved == 0.0, 0.0, moved / (np.sqrt(np.maximum(squares, 0.0)) / size))
            high, low = np.nanquantile(t, tails, axis=1)
            ends = -np.stack([low, high]) * error
            known = np.isfinite(ends).all(axis=0) & ((wholes > 0.0).sum(axis=1) >= fewest)
            ends = np.where(known, ends, np.nanquantile(moved, tails, axis=1))
            each = np.where(wholes > 0.0, parts / wholes, np.nan)
            lowest, highest = np.nanmin(each, axis=1), np.nanmax(each, axis=1)
        ends = np.round(centre[:, 0] / scale[:, 0] + ends, DIGITS) * scale[:, 0]
        return np.clip(ends, lowest, highest)

    def _sums(self, values: Array) -> Array:
        """Of each resample of each row of values (F, n), in single precision: (F, R)."""
        return (values.astype(np.float32) @ self._counts.T).astype(float)

    def p_values(self, differences: ArrayLike) -> list[float | None]:
        """For each row of paired differences (F, n), of the hypothesis that they are as likely to be negative.

        By flipping signs at random: (1 + how often |mean of flipped| >= |mean|) / (1 + flips); None where all are NaN.
        Source: Good, Permutation, Parametric and Bootstrap Tests of Hypotheses, 3rd ed., 2005, section 3.2.
        """
        differences = np.asarray(differences, float)
        known = np.isfinite(differences)
        kept = np.where(known, differences, 0.0)
        scales = np.where(kept.any(axis=1), np.abs(kept).max(axis=1), 1.0)
        flipped = (kept / scales[:, None]).astype(np.float32) @ self._signs.T  # (F, R)
        least = np.abs(kept.sum(axis=1)) / scales * (1.0 - 1e-6)  # what is equal but for rounding counts
        reached = (np.abs(flipped) >= least[:, None]).sum(axis=1)
        return [
            float((1 + count) / (1 + len(self._signs))) if there.any() else None
            for count, there in zip(reached, known, strict=True)
        ]


def mcnemar(only_a: int, only_b: int) -> float:
    """p-value of equal success rates from the pairs in which one method alone succeeded: the exact binomial test.

    Source: McNemar, Psychometrika 12 (1947) 153.
    """
    if only_a + only_b == 0:
        return 1.0
    from scipy.special import bdtr

    return min(1.0, 2.0 * float(bdtr(min(only_a, only_b), only_a + only_b, 0.5)))


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
