"""Noise that is correlated in time, with the marginal law of any distribution.

A standard normal process of first order is mapped to the law through both distribution functions (a Gaussian copula:
Sklar 1959; Cario & Nelson 1996, "Autoregressive to anything"):

    z_k = rho z_k-1 + sqrt(1 - rho^2) e_k,   e_k ~ N(0, 1),   rho = exp(-T / tau),   x_k = F^-1(Phi(z_k))

with T between two draws. Of a Gaussian law x has the autocorrelation rho^n, of a skewed one a little less.
"""

from dataclasses import dataclass
from math import exp, sqrt

import numpy as np

from mjnav.constant import Constant
from mjnav.messages import Array
from mjnav.noise.base import Distribution

REACH, POINTS = 15.0, 12_001  # standard deviations to both sides of the mean, and places at which the density is taken


@dataclass(frozen=True, slots=True)
class DistributionFunction(Constant):
    """F of a distribution, by the trapezoidal rule on its density."""

    x: Array  # (n,), rising
    share: Array  # (n,) F(x), from 0 to 1

    @classmethod
    def of(cls, law: Distribution) -> "DistributionFunction":
        """Within REACH standard deviations of the mean; a point mass is a step."""
        if law.std == 0.0:
            return cls(np.full(2, law.mean), np.array([0.0, 1.0]))
        low, high = law.support
        x = np.linspace(max(low, law.mean - REACH * law.std), min(high, law.mean + REACH * law.std), POINTS)
        density = np.exp(np.minimum(law.logpdf(x), 700.0))
        share = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
        return cls(x, share / share[-1])

    def below(self, x: Array) -> Array:
        """F(x)."""
        return np.interp(x, self.x, self.share)

    def quantile(self, share: Array) -> Array:
        """F^-1."""
        return np.interp(share, self.share, self.x)


class Correlated:
    """Draws of one law, one after another, with the correlation time tau."""

    def __init__(self, law: Distribution, period: float, tau: float):
        """`period` [s] between two draws, `tau` [s]."""
        self._function, self._rho = DistributionFunction.of(law), exp(-period / tau)
        self._z: float | None = None  # the latest

    def sample(self, rng: np.random.Generator, num: int) -> Array:
        """The next `num` draws."""
        from scipy.special import ndtr  # slow to import

        normal, z = rng.standard_normal(num).tolist(), np.empty(num)
        for k, e in enumerate(normal):
            self._z = e if self._z is None else self._rho * self._z + sqrt(1.0 - self._rho**2) * e
            z[k] = self._z
        return self._function.quantile(ndtr(z))
