"""The Pearson family: the distribution that has four given moments.

Its densities solve p'(z)/p(z) = -(b1 + d z)/(b0 + b1 z + b2 z^2) for mean 0 and std 1, with

    b0 = 4 kurtosis - 3 skew^2,  b1 = skew (kurtosis + 3),  b2 = 2 kurtosis - 3 skew^2 - 6,
    d = 10 kurtosis - 12 skew^2 - 18

and the roots of the denominator tell the type (Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions,
2nd ed., 12.4.1). Kurtosis is Pearson's: 3 for a Gaussian.
"""

from dataclasses import dataclass, field
from math import inf, log, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from mjnav.config import Range, settle
from mjnav.constant import Constant
from mjnav.errors import InvalidValue
from mjnav.messages import Array
from mjnav.noise.base import Mean, Size, Spread
from mjnav.noise.pearson_iv import TypeIVLaw
from mjnav.noise.pearson_laws import BetaLaw, BetaPrimeLaw, GammaLaw, GaussianLaw, InverseGammaLaw, Law, StudentLaw

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
class Pearson(Constant):
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

    def __post_init__(self):
        settle(self)
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
