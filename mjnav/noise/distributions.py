"""The distributions with a density of a line or two; the Pearson family is in `pearson`."""

from dataclasses import dataclass, field
from math import inf, log, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.noise.base import MOST, Mean, OnRealLine, Size, Spread
from mjnav.noise.pearson import HALF_LOG_2PI, StudentLaw
from mjnav.settings import Length, Range, Settled

_WEIGHT_SUM_TOLERANCE = 1e-5  # weights are written with a few digits: 0.412982, 0.361616, 0.225401
MAX_SAMPLES = 10_000  # a likelihood costs each of them at each of its thousands of cells
_Share = Annotated[float, Range(0.0, 1.0, open_low=True)]


def _gaussian_logpdf(x: ArrayLike, mean: float | Array, std: float) -> Array:
    with np.errstate(over="ignore"):  # infinite squares give the density 0 that they should
        return -0.5 * np.square((np.asarray(x, float) - mean) / std) - (HALF_LOG_2PI + log(std))


@dataclass(frozen=True, slots=True, kw_only=True)
class Zero(Constant, OnRealLine):
    """No noise: every draw is exactly 0, and `mean` and `std` are 0.

    A point mass has no density. `logpdf` is that of a Gaussian of std NARROW, so that a likelihood built from it
    stays finite; an estimator that needs more width can tell by `std == 0`.
    """

    NARROW = 1e-3  # in the channel's unit

    @property
    def mean(self) -> float:
        """0."""
        return 0.0

    @property
    def std(self) -> float:
        """0."""
        return 0.0

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Zeros; takes nothing from `rng`."""
        return np.zeros(size)

    def logpdf(self, x: ArrayLike) -> Array:
        """Log-density of a Gaussian of std NARROW."""
        return _gaussian_logpdf(x, 0.0, self.NARROW)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gaussian(Settled, Constant, OnRealLine):
    """N(mean, std^2)."""

    mean: Mean = 0.0
    std: Spread

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`."""
        return rng.normal(self.mean, self.std, size)

    def logpdf(self, x: ArrayLike) -> Array:
        """-((x - mean)/std)^2 / 2 - log(std sqrt(2 pi))."""
        return _gaussian_logpdf(x, self.mean, self.std)


@dataclass(frozen=True, slots=True, kw_only=True)
class Uniform(Settled, Constant):
    """Constant density on [mean - half_width, mean + half_width]; std = half_width / sqrt(3)."""

    mean: Mean = 0.0
    half_width: Annotated[float, Range(0.0, MOST, open_low=True), "of the interval, in the channel's unit"]

    @property
    def std(self) -> float:
        """half_width / sqrt(3)."""
        return self.half_width / sqrt(3.0)

    @property
    def support(self) -> tuple[float, float]:
        """Both ends."""
        return self.mean - self.half_width, self.mean + self.half_width

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`."""
        return rng.uniform(*self.support, size)

    def logpdf(self, x: ArrayLike) -> Array:
        """-log(2 half_width) inside, ends included."""
        low, high = self.support
        x = np.asarray(x, float)
        return np.where((x >= low) & (x <= high), -log(2.0 * self.half_width), -inf)


@dataclass(frozen=True, slots=True, kw_only=True)
class StudentT(Settled, Constant, OnRealLine):
    """Student's t with `df` > 2 degrees of freedom, scaled so that `std` is its standard deviation.

    Kurtosis is 3 + 6/(df - 4) for df > 4 and infinite below: heavy tails at a known variance.
    """

    mean: Mean = 0.0
    std: Spread
    df: Annotated[float, Range(2.0, 1e9, open_low=True), "degrees of freedom"]
    _law: StudentLaw = field(init=False, repr=False, compare=False)

    def _check(self):
        object.__setattr__(self, "_law", StudentLaw.of(self.df))

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`."""
        return self.mean + self.std * self._law.sample(rng, size)

    def logpdf(self, x: ArrayLike) -> Array:
        """Log-density at `x`."""
        with np.errstate(over="ignore"):
            return self._law.logpdf((np.asarray(x, float) - self.mean) / self.std) - log(self.std)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mixture(Settled, Constant, OnRealLine):
    """sum_k weights_k N(means_k, stds_k^2); weights are positive and sum to 1."""

    weights: Annotated[tuple[_Share, ...], Length(1, MAX_SAMPLES), "of the components; they sum to 1"]
    means: Annotated[tuple[Mean, ...], Length(1, MAX_SAMPLES), "of the components, as many as weights"]
    stds: Annotated[tuple[Spread, ...], Length(1, MAX_SAMPLES), "of the components, as many as weights"]
    _shares: tuple[float, ...] = field(init=False, repr=False, compare=False)  # the weights, their sum exactly 1
    _cumulative: Array = field(init=False, repr=False, compare=False)

    def _check(self):
        for key in ("means", "stds"):
            if len(getattr(self, key)) != len(self.weights):
                raise InvalidValue(key, getattr(self, key), f"as many numbers as weights: {len(self.weights)}")
        total = sum(self.weights)
        if abs(total - 1.0) > _WEIGHT_SUM_TOLERANCE:
            raise InvalidValue("weights", self.weights, f"numbers whose sum is 1, not {total:g}")
        object.__setattr__(self, "_shares", tuple(weight / total for weight in self.weights))
        object.__setattr__(self, "_cumulative", np.cumsum(self._shares)[:-1])

    @property
    def mean(self) -> float:
        """sum_k w_k m_k."""
        return float(np.dot(self._shares, self.means))

    @property
    def std(self) -> float:
        """Root of sum_k w_k (s_k^2 + (m_k - mean)^2)."""
        return sqrt(np.dot(self._shares, np.square(self.stds) + np.square(np.subtract(self.means, self.mean))))

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`."""
        k = np.searchsorted(self._cumulative, rng.random(size), side="right")
        return np.take(self.means, k) + np.take(self.stds, k) * rng.standard_normal(size)

    def logpdf(self, x: ArrayLike) -> Array:
        """log sum_k exp(log w_k + log N(x; m_k, s_k^2)), safe far away from every component."""
        x = np.asarray(x, float)
        terms = [
            log(w) + _gaussian_logpdf(x, m, s) for w, m, s in zip(self._shares, self.means, self.stds, strict=True)
        ]
        total = terms[0]
        for term in terms[1:]:
            total = np.logaddexp(total, term)
        return total


def thinned(samples: list[float]) -> list[float]:
    """The samples themselves; of more than MAX_SAMPLES so many quantiles at even distances."""
    if len(samples) <= MAX_SAMPLES:
        return samples
    return np.quantile(samples, (np.arange(MAX_SAMPLES) + 0.5) / MAX_SAMPLES).tolist()


@dataclass(frozen=True, slots=True, kw_only=True)
class Empirical(Settled, Constant, OnRealLine):
    """Recorded errors, smoothed: a Gaussian of std `bandwidth` around each sample.

    bandwidth h = 0.9 min(s, IQR/1.34) n^(-1/5), with the samples' standard deviation s and interquartile range IQR
    (Silverman, Density Estimation, 1986, eq. 3.31). Draws and `logpdf` are of this one density, whose mean is that of
    the samples and whose variance is s^2 + h^2. `logpdf` of m points costs m n exponentials.
    """

    samples: Annotated[tuple[Mean, ...], Length(2, MAX_SAMPLES), "recorded errors, in the channel's unit"]
    bandwidth: float = field(init=False)
    mean: float = field(init=False)
    std: float = field(init=False)
    _array: Array = field(init=False, repr=False, compare=False)

    def _check(self):
        samples = np.array(self.samples)
        spread = float(samples.std())
        if spread == 0.0:
            raise InvalidValue("samples", self.samples, "at least two different numbers")
        quartiles = np.percentile(samples, [25, 75])
        narrow = min(spread, float(quartiles[1] - quartiles[0]) / 1.34) or spread  # IQR is 0 where most are equal
        bandwidth = 0.9 * narrow * len(samples) ** -0.2
        object.__setattr__(self, "bandwidth", bandwidth)
        object.__setattr__(self, "mean", float(samples.mean()))
        object.__setattr__(self, "std", float(np.hypot(spread, bandwidth)))
        object.__setattr__(self, "_array", samples)

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`: a sample at random, and the kernel's Gaussian."""
        chosen = self._array[rng.integers(len(self._array), size=size)]
        return chosen + self.bandwidth * rng.standard_normal(size)

    def logpdf(self, x: ArrayLike) -> Array:
        """log (1/n) sum_i N(x; samples_i, bandwidth^2), safe far away from every sample."""
        x = np.asarray(x, float)
        return np.array([self._logpdf_at(value) for value in x.flat]).reshape(x.shape)

    def _logpdf_at(self, x: float) -> float:
        terms = _gaussian_logpdf(x, self._array, self.bandwidth)
        largest = terms.max()
        if largest == -inf:
            return -inf
        return float(largest + np.log(np.exp(terms - largest).mean()))
