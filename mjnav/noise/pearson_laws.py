"""Members of the Pearson family with mean 0, standard deviation 1 and skew >= 0.

Each is written around its mean, as powers of 1 + c z, and its constant with Stirling's remainders R: both stay exact
where a member passes into its neighbour and its shape parameters grow without bound. Parametrisations and moments as
in Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions, 2nd ed., chapters 12, 17, 25, 27 and 28.
"""

from dataclasses import dataclass
from math import inf, log, log1p, pi, sqrt
from typing import Protocol

import numpy as np

from mjnav.messages import Array
from mjnav.noise.base import Size
from mjnav.noise.stirling import stirling_remainder as R

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
