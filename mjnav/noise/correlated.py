"""Noise that is correlated in time, with the marginal law of any distribution.

A standard normal process of first order is mapped to the law through both distribution functions (a Gaussian copula:
Sklar 1959; Cario & Nelson 1996, "Autoregressive to anything"):

    z_k = rho z_k-1 + sqrt(1 - rho^2) e_k,   e_k ~ N(0, 1),   rho = exp(-T / tau),   x_k = F^-1(Phi(z_k))

with T between two draws. Of a Gaussian law x has the autocorrelation rho^n, of a skewed one a little less.
"""

from dataclasses import dataclass
from math import exp, sqrt
from typing import Any

import numpy as np

from mjnav.constant import Constant
from mjnav.messages import Array
from mjnav.noise.base import Distribution
from mjnav.noise.distributions import Empirical, Mixture

REACH, FARTHEST = 15.0, 1e6  # [std] from the mean: of places that are evenly apart, and of the last one along a tail
POINTS = 12_001  # evenly apart
NEAREST, DECADE = 1e-12, 250  # of the support, from a hard end; places from there on to ten times as far away
WIDTHS = 8.0  # [std] of a Gaussian, beyond which nothing is left of it


@dataclass(frozen=True, slots=True)
class DistributionFunction(Constant):
    """F of a distribution, by the trapezoidal rule on its density."""

    x: Array  # (n,), rising
    share: Array  # (n,) F(x), from 0 to 1

    @classmethod
    def of(cls, law: Distribution) -> "DistributionFunction":
        """F at `_places`; a point mass is a step."""
        if law.std == 0.0:
            return cls(np.full(2, law.mean), np.array([0.0, 1.0]))
        x = _places(law)
        logs = np.minimum(law.logpdf(x), 700.0)
        density, (low, high) = np.exp(logs), law.support
        inner = 0.5 * (density[1:] + density[:-1]) * np.diff(x)
        ends = _beyond(x - low, logs), _beyond(high - x[::-1], logs[::-1])
        share = np.cumsum(np.concatenate([[0.0, ends[0]], inner, [ends[1]]]))
        return cls(np.concatenate([[max(low, x[0] - 1.0)], x, [min(high, x[-1] + 1.0)]]), share / share[-1])

    def below(self, x: Array) -> Array:
        """F(x)."""
        return np.interp(x, self.x, self.share)

    def quantile(self, share: Array) -> Array:
        """F^-1."""
        return np.interp(share, self.share, self.x)


def _places(law: Distribution) -> Array:
    """Where the density of a law is taken, rising, inside its support.

    Evenly; denser and denser towards a hard end, where it may be infinite; sparser and sparser along a tail; and about
    every Gaussian of a sum of them.
    """
    if isinstance(law, Mixture | Empirical):
        gaussians = (law.means, law.stds) if isinstance(law, Mixture) else (law.samples, law.bandwidth)
        centre, width = np.broadcast_arrays(*gaussians)
        some = np.linspace(0, len(centre) - 1, min(len(centre), POINTS // 3)).astype(int)
        about = np.linspace(-WIDTHS, WIDTHS, POINTS // len(some))
        close = (centre[some, None] + width[some, None] * about).ravel()
        ends = (centre - WIDTHS * width).min(), (centre + WIDTHS * width).max()
        return np.unique(np.concatenate([np.linspace(*ends, POINTS), close]))
    (low, high), reach = law.support, REACH * law.std
    first, last = max(low, law.mean - reach), min(high, law.mean + reach)
    near = np.geomspace(NEAREST, 1.0, DECADE * 12) * (last - first)
    far = np.geomspace(reach, FARTHEST * law.std, 1000)
    x = [np.linspace(first, last, POINTS), low + near, high - near, law.mean - far, law.mean + far]
    x = np.unique(np.concatenate(x))
    return x[np.isfinite(x) & (x >= low + near[0]) & (x <= high - near[0])]


def _beyond(away: Array, logs: Array) -> float:
    """The share between a support's end and the first of places, `away` (n,) from it, of a log-density `logs` there.

    Towards a hard end a density goes as c r^(a - 1) with the distance r: c r^a / a is left.
    """
    if not np.isfinite(away[0]) or np.exp(logs[0]) == 0.0:
        return 0.0
    a = 1.0 + (logs[DECADE] - logs[0]) / np.log(away[DECADE] / away[0])
    return float(np.exp(logs[0]) * away[0] / max(a, 1e-6))


# Share of draws beyond which scores count as alike, 3.7 standard deviations: at a law's hard edge draws follow one
# another so closely that a belief of particles would be left with one of them.
LEAST_SHARE = 1e-4


@dataclass(frozen=True, slots=True)
class Copula(Constant):
    """Draws x of a law with the correlation time tau [s] as values of the process z, and back."""

    function: DistributionFunction
    tau: float

    @classmethod
    def of(cls, law: Distribution, tau: float) -> "Copula":
        """Of the law's draws."""
        return cls(DistributionFunction.of(law), tau)

    def following(self, z: Array, interval: float, normal: Array) -> Array:
        """The scores `interval` [s] after `z`, with as many `normal` draws of N(0, 1)."""
        rho = exp(-interval / self.tau)
        return rho * z + sqrt(1.0 - rho**2) * normal

    def values(self, z: Array) -> Array:
        """x of scores z."""
        from scipy.special import ndtr  # slow to import

        return self.function.quantile(ndtr(z))

    def scores(self, x: Array) -> Array:
        """z of draws x."""
        from scipy.special import ndtri  # slow to import

        return ndtri(np.clip(self.function.below(x), LEAST_SHARE, 1.0 - LEAST_SHARE))

    def news(self, x: Array, before: Array, interval: float) -> Array:
        """p(x | before) / p(x), (n,), of draws x (n,) `interval` [s] after the draws `before` (n,).

        It is exp((z^2 - (z - rho z0)^2 / (1 - rho^2)) / 2) / sqrt(1 - rho^2).
        """
        z, z0, rho = self.scores(x), self.scores(before), exp(-interval / self.tau)
        variance = 1.0 - rho**2
        return np.exp(0.5 * (z * z - (z - rho * z0) ** 2 / variance)) / sqrt(variance)


class Correlated:
    """Draws of one law, one after another, with the correlation time tau."""

    def __init__(self, law: Distribution, period: float, tau: float):
        """`period` [s] between two draws, `tau` [s]."""
        self._copula, self._period = Copula.of(law, tau), period
        self._z: Any = None  # the latest score

    def sample(self, rng: np.random.Generator, num: int) -> Array:
        """The next `num` draws."""
        z = rng.standard_normal(num)
        for k in range(num):
            if self._z is not None:
                z[k] = self._copula.following(self._z, self._period, z[k])
            self._z = z[k]
        return self._copula.values(z)
