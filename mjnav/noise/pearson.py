"""The Pearson family: the distribution that has four given moments, and the laws of its types other than IV.

The laws have mean 0, standard deviation 1 and skew >= 0. Each is written around its mean, as powers of 1 + c z, and its
constant with Stirling's remainders R: both stay exact where a member passes into its neighbour and its shape parameters
grow without bound. Parametrisations and moments as in Johnson, Kotz & Balakrishnan, Continuous Univariate
Distributions, 2nd ed., chapters 12, 17, 25, 27 and 28. Type IV is in `pearson_iv`.

The family's densities solve p'(z)/p(z) = -(b1 + d z)/(b0 + b1 z + b2 z^2) for mean 0 and std 1, with

    b0 = 4 kurtosis - 3 skew^2,  b1 = skew (kurtosis + 3),  b2 = 2 kurtosis - 3 skew^2 - 6,
    d = 10 kurtosis - 12 skew^2 - 18

and the roots of the denominator tell the type (Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions,
2nd ed., 12.4.1). Kurtosis is Pearson's: 3 for a Gaussian.
"""

from dataclasses import dataclass, field
from math import inf, log, log1p, pi, sqrt
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.noise.base import Mean, Size, Spread
from mjnav.noise.pearson_iv import TypeIVLaw
from mjnav.noise.pearson_iv import stirling_remainder as R
from mjnav.settings import Range, Settled

# ----------------------------------------------------------------------------------------------- laws


HALF_LOG_2PI = 0.5 * log(2.0 * pi)
_EDGE = -1.0 + 2.0**-53  # nearest to -1: at an edge a density that is infinite or zero takes its value one ulp inside


class Law(Protocol):
    """A density of mean 0 and standard deviation 1."""

    @property
    def support(self) -> tuple[float, float]:
        """Where the density is positive."""
        ...

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        ...

    def logpdf(self, z: Array) -> Array:
        """Log-density at z inside the support."""
        ...


def _log_ratio(c: float, z: Array) -> Array:
    """log(1 + c z), finite at the support's edge -1/c."""
    return np.log1p(np.maximum(c * z, _EDGE))


@dataclass(frozen=True, slots=True)
class _FromEdge:
    """What begins where 1 + c z is 0 and has no other end."""

    c: float

    @property
    def support(self) -> tuple[float, float]:
        """From -1/c on."""
        return -1.0 / self.c, inf


@dataclass(frozen=True, slots=True)
class GaussianLaw:
    """Type 0: p(z) = exp(-z^2/2) / sqrt(2 pi)."""

    support: tuple[float, float] = (-inf, inf)

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        return rng.standard_normal(size)

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        return -0.5 * z * z - HALF_LOG_2PI


@dataclass(frozen=True, slots=True)
class BetaLaw:
    """Types I and II: x = (a/n)(1 + c z) is Beta(a, b), n = a + b, c^2 = b / (a (n + 1)).

    p(z) = exp(constant) (1 + c z)^(a - 1) (1 - c z a/b)^(b - 1)
    """

    a: float
    b: float
    c: float
    constant: float

    @classmethod
    def of(cls, a: float, b: float) -> "BetaLaw":
        """The law of shapes a <= b."""
        n = a + b
        c = sqrt(b / (a * (n + 1.0)))
        constant = 0.5 * log(n / (a * b)) - R(a) - R(b) + R(n) - HALF_LOG_2PI + log(a * c)
        return cls(a, b, c, constant)

    @property
    def support(self) -> tuple[float, float]:
        """Where x is 0 and 1."""
        return -1.0 / self.c, ((self.a + self.b) / self.a - 1.0) / self.c

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        return (rng.beta(self.a, self.b, size) * ((self.a + self.b) / self.a) - 1.0) / self.c

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        upper = _log_ratio(-self.c * self.a / self.b, z)
        return self.constant + (self.a - 1.0) * _log_ratio(self.c, z) + (self.b - 1.0) * upper


@dataclass(frozen=True, slots=True)
class GammaLaw(_FromEdge):
    """Type III: x = k (1 + c z) is Gamma(k), c = 1/sqrt(k) = skew/2.

    p(z) = exp(constant) (1 + c z)^(k - 1) exp(-k c z)
    """

    k: float
    constant: float

    @classmethod
    def of(cls, skew: float) -> "GammaLaw":
        """The law of skew > 0; its kurtosis is 3 + 1.5 skew^2."""
        k = 4.0 / skew**2
        return cls(0.5 * skew, k, -HALF_LOG_2PI - R(k))

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        return (rng.standard_gamma(self.k, size) / self.k - 1.0) / self.c

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        return self.constant + (self.k - 1.0) * _log_ratio(self.c, z) - z / self.c


@dataclass(frozen=True, slots=True)
class InverseGammaLaw(_FromEdge):
    """Type V: (a - 1)/(1 + c z) is Gamma(a), c = 1/sqrt(a - 2).

    p(z) = exp(constant) (1 + c z)^(-a - 1) exp((a - 1) c z / (1 + c z))
    """

    a: float
    constant: float

    @classmethod
    def of(cls, skew: float) -> "InverseGammaLaw":
        """The law of skew = 4 sqrt(a - 2)/(a - 3) > 0, which gives a."""
        root = (2.0 + sqrt(4.0 + skew**2)) / skew
        a = root**2 + 2.0
        constant = 0.5 * log(a) + a * log1p(-1.0 / a) + 1.0 - HALF_LOG_2PI - R(a) - log(root)
        return cls(1.0 / root, a, constant)

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        return ((self.a - 1.0) / rng.standard_gamma(self.a, size) - 1.0) / self.c

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        ratio = np.maximum(self.c * z, _EDGE)
        return self.constant - (self.a + 1.0) * np.log1p(ratio) + (self.a - 1.0) * (ratio / (1.0 + ratio))


@dataclass(frozen=True, slots=True)
class BetaPrimeLaw(_FromEdge):
    """Type VI: x = a/(b - 1) (1 + c z) is Beta'(a, b), c^2 = (a + b - 1)/(a (b - 2)), 1 + x = (1 + mean)(1 + e z).

    p(z) = exp(constant) (1 + c z)^(a - 1) (1 + e z)^(-a - b)
    """

    a: float
    b: float
    e: float
    constant: float

    @classmethod
    def of(cls, a: float, b: float) -> "BetaPrimeLaw":
        """The law of shapes a > 0, b > 4."""
        n = a + b
        c = sqrt((n - 1.0) / (a * (b - 2.0)))
        powers = b * log1p(-1.0 / b) - n * log1p(-1.0 / n)
        constant = powers + 0.5 * log(a * b / n) - HALF_LOG_2PI - R(a) - R(b) + R(n) + log(c)
        return cls(c, a, b, c * a / (n - 1.0), constant)

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        ratio = rng.standard_gamma(self.a, size) / rng.standard_gamma(self.b, size)
        return (ratio * ((self.b - 1.0) / self.a) - 1.0) / self.c

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        return self.constant + (self.a - 1.0) * _log_ratio(self.c, z) - (self.a + self.b) * _log_ratio(self.e, z)


@dataclass(frozen=True, slots=True)
class StudentLaw:
    """Type VII: z = t sqrt((df - 2)/df), t Student's; p(z) = exp(constant) (1 + z^2/(df - 2))^(-(df + 1)/2)."""

    df: float
    constant: float
    support: tuple[float, float] = (-inf, inf)

    @classmethod
    def of(cls, df: float) -> "StudentLaw":
        """The law of df > 2 degrees of freedom."""
        a = 0.5 * df
        gammas = a * log1p(0.5 / a) - 0.5 + R(a + 0.5) - R(a)
        return cls(df, gammas + 0.5 * log(a / (df - 2.0)) - 0.5 * log(pi))

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        return rng.standard_t(self.df, size) * sqrt((self.df - 2.0) / self.df)

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        return self.constant - 0.5 * (self.df + 1.0) * np.log1p(z * z / (self.df - 2.0))


# --------------------------------------------------------------------------------------------- family


# Moments this close to a boundary between types, relative to the terms that cancel there, lie on it.
_BOUNDARY = 1e-9
_SYMMETRIC = 1e-8  # skew below which a density is symmetric
_MAX_SKEW = 1e3  # beyond, the difference between kurtosis and skew^2 + 1 has too few digits left
_MAX_KURTOSIS = 1e7  # beyond, type IV and VII have r - 3 below 1e-6: hardly a fourth moment
_FARTHEST = 1e100  # [std] beyond, every density of the family is below what a float can hold


def pearson_type(skew: float, kurtosis: float) -> str:
    """The type, "0" (Gaussian) or "I" to "VII", of the member with these moments.

    I is a beta, II a symmetric beta, III a gamma, V an inverse gamma, VI a beta prime, VII a Student t; IV has no other
    name. Moments must be possible: kurtosis > skew^2 + 1.
    """
    b0 = 4.0 * kurtosis - 3.0 * skew**2
    b1 = skew * (kurtosis + 3.0)
    b2 = 2.0 * kurtosis - 3.0 * skew**2 - 6.0
    symmetric = abs(skew) <= _SYMMETRIC
    if abs(b2) <= _BOUNDARY * (2.0 * kurtosis + 3.0 * skew**2 + 6.0):
        return "0" if symmetric else "III"
    if b2 < 0.0:
        return "II" if symmetric else "I"
    if symmetric:
        return "VII"
    criterion = b1**2 / (4.0 * b0 * b2)  # Pearson's kappa: 1 where the roots meet
    if abs(criterion - 1.0) <= _BOUNDARY:
        return "V"
    return "IV" if criterion < 1.0 else "VI"


def _law(skew: float, kurtosis: float) -> Law:
    """The member of mean 0 and std 1 with these moments, skew >= 0."""
    kind = pearson_type(skew, kurtosis)
    if kind == "0":
        return GaussianLaw()
    if kind == "III":
        return GammaLaw.of(skew)
    if kind == "V":
        return InverseGammaLaw.of(skew)
    square = skew**2
    b2 = 2.0 * kurtosis - 3.0 * square - 6.0
    r = 6.0 * (kurtosis - square - 1.0) / abs(b2)
    if kind in ("I", "II"):  # shapes a, b = r/2 (1 -+ root), r = a + b
        spread = square * (r + 2.0) ** 2 + 16.0 * (r + 1.0)
        root = (r + 2.0) * sqrt(square / spread)
        return BetaLaw.of(8.0 * r * (r + 1.0) / (spread * (1.0 + root)), 0.5 * r * (1.0 + root))
    if kind == "VI":  # a = r/2 (root - 1), b = r + 1
        spread = square * (r - 2.0) ** 2 - 16.0 * (r - 1.0)
        root = (r - 2.0) * sqrt(square / spread)
        return BetaPrimeLaw.of(8.0 * r * (r - 1.0) / (spread * (1.0 + root)), r + 1.0)
    return StudentLaw.of(r + 1.0) if kind == "VII" else TypeIVLaw.of(r, skew)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pearson(Settled, Constant):
    """The member of the Pearson family with these four moments; kurtosis > skew^2 + 1.

    Draws are exact: numpy's beta, gamma and Student generators, rejection for type IV. At kurtosis = skew^2 + 1 only
    two points are left, which have no density, and below nothing is: both raise InvalidValue.
    """

    mean: Mean = 0.0
    std: Spread
    skew: Annotated[float, Range(-_MAX_SKEW, _MAX_SKEW), "third standardised moment; 0 is symmetric"]
    kurtosis: Annotated[float, Range(1.0, _MAX_KURTOSIS, open_low=True), "above skew² + 1; 3 for a Gaussian"]
    _law: Law = field(init=False, repr=False, compare=False)
    _sign: float = field(init=False, repr=False, compare=False)
    _ends: tuple[float, float] = field(init=False, repr=False, compare=False)  # of where the density is computed

    def _check(self):
        least = self.skew**2 + 1.0
        if self.kurtosis <= least * (1.0 + _BOUNDARY):
            raise InvalidValue("kurtosis", self.kurtosis, f"a number > skew² + 1 = {least:.6g} (a Gaussian has 3)")
        object.__setattr__(self, "_law", _law(abs(self.skew), self.kurtosis))
        object.__setattr__(self, "_sign", -1.0 if self.skew < 0.0 else 1.0)
        (low, high), far = self.support, _FARTHEST * self.std
        object.__setattr__(self, "_ends", (max(low, self.mean - far), min(high, self.mean + far)))

    @property
    def type(self) -> str:
        """Its Pearson type, as `pearson_type` names it."""
        return pearson_type(self.skew, self.kurtosis)

    @property
    def support(self) -> tuple[float, float]:
        """The interval outside of which the density is zero."""
        low, high = (self.mean + self._sign * self.std * end for end in self._law.support)
        return (low, high) if low < high else (high, low)

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`."""
        return self.mean + self._sign * self.std * self._law.sample(rng, size)

    def logpdf(self, x: ArrayLike) -> Array:
        """Log-density at `x`; -inf outside the support, finite at its ends even where the density is infinite."""
        x = np.asarray(x, float)
        low, high = self._ends
        inside = (x >= low) & (x <= high)
        z = (np.where(inside, x, self.mean) - self.mean) * (self._sign / self.std)
        return np.where(inside, self._law.logpdf(z) - log(self.std), -inf)
