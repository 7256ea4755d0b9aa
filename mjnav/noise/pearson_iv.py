"""Pearson's type IV with mean 0, standard deviation 1 and skew > 0; its draws come from exact rejection.

Stirling's remainder is what Stirling's formula for the gamma function leaves over where the argument is large.
Normalising constants of densities are ratios of gamma functions. Near a boundary between two Pearson types their
arguments grow without bound, and a difference of log gammas loses all its digits; Stirling's leading terms cancel on
paper, and only remainders, which are small, are left to compute.

With t = (z - location)/scale, p(t) is proportional to (1 + t^2)^(-m) exp(-nu atan t) (Heinrich, A Guide to the
Pearson Type IV Distribution, CDF/MEMO/STATISTICS/PUBLIC/6820, 2004). Here r = 2 m - 2, t0 = -nu/r is the t of the mean,
and everything is written around the mean, as in `pearson`:

    p(z) = exp(constant) |1 + c z|^(-2 m) exp(-nu arg(1 + c z)),  c = (t0 + i) / (scale (1 + t0^2))

The angle psi = arg(1 + c z) has a log-concave density, largest at psi = 0, the mean:

    g(psi) = exp(r (log(cos psi - t0 sin psi) + t0 psi)),  |psi + atan t0| < pi/2

A staircase over g, made once, is the envelope: nearly every proposal is accepted, most without evaluating g. In the
compiled loop of the rejection every operation is rounded as written, so that a seed's draws replay.
"""

import cmath
from dataclasses import dataclass, field
from math import atan2, exp, inf, log, log1p, pi, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Indices, Matrix, Vector, exact
from mjnav.messages import Array
from mjnav.noise.base import Size

# ------------------------------------------------------------------------------- Stirling's remainder


# B_2k / (2k (2k - 1)) for k = 1 .. 5, with Bernoulli's numbers; Abramowitz & Stegun 6.1.40.
_SERIES = (1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188)
_LARGE = 12.0  # from this modulus on the first term left out is below 3e-15


def complex_log1p(u: complex) -> complex:
    """log(1 + u), exact also for small u."""
    return complex(0.5 * log1p(2.0 * u.real + abs(u) ** 2), atan2(u.imag, 1.0 + u.real))


def stirling_remainder(z: complex) -> float:
    """Re R(z), where log Gamma(z) = (z - 1/2) log z - z + log(2 pi)/2 + R(z), for Re z > 0.

    R(z) = R(z + 1) + (z + 1/2) log(1 + 1/z) - 1 leads to a modulus for which the asymptotic series is exact.
    """
    remainder = 0j
    while abs(z) < _LARGE:
        remainder += (z + 0.5) * cmath.log(1.0 + 1.0 / z) - 1.0
        z += 1.0
    return (remainder + sum(c / z ** (2 * k + 1) for k, c in enumerate(_SERIES))).real


# ------------------------------------------------------------------------------------------ rejection


_EDGE = -1.0 + 2.0**-53


@exact
def accept(u: Matrix, left: Vector, high: Vector, low: Vector, area: Vector, guide: Indices, r: float, t0: float):
    """The psi that rejection accepts of m proposals by uniform draws u (2, m), in order.

    A step of the staircase is searched from `guide` on; below `low` no proposal needs g. See `pearson_iv`.
    """
    accepted = np.empty(u.shape[1])
    count = 0
    for i in range(u.shape[1]):
        below = u[0, i] * area[-1]
        step = guide[int(u[0, i] * len(guide))]
        while step + 1 < len(high) and area[step + 1] <= below:
            step += 1
        psi = left[step] + (below - area[step]) / high[step]
        height = u[1, i] * high[step]
        if height > low[step]:
            cosine = -2.0 * sin(0.5 * psi) ** 2 - t0 * sin(psi)
            if height > exp(r * (log1p(max(cosine, _EDGE)) + t0 * psi)):
                continue
        accepted[count] = psi
        count += 1
    return accepted[:count]


# -------------------------------------------------------------------------------------------- type IV


_STEPS = 256  # of the staircase, on each side of the mode
_GUIDES = 512  # a power of two, so that k/_GUIDES is exact
_LOG_CUT = -45.0  # log g at which the staircase may end: what it leaves out has a probability below 1e-18


@dataclass(frozen=True, slots=True, eq=False)
class Staircase:
    """Steps from `left`, as high as g's largest (`high`) and smallest (`low`) value on each, and their areas' sums."""

    left: Array  # (2 _STEPS,)
    high: Array  # (2 _STEPS,)
    low: Array  # (2 _STEPS,)
    area: Array  # (2 _STEPS + 1,) from 0 to the whole area
    guide: Array  # (_GUIDES,) the step in which k/_GUIDES of the whole area lies: where a search for more begins


@dataclass(frozen=True, slots=True)
class TypeIVLaw:
    """The law of r > 3 and t0 > 0."""

    r: float
    t0: float
    scale: float
    constant: float
    support: tuple[float, float] = (-inf, inf)
    staircase: Staircase = field(init=False, repr=False, compare=False)

    def __post_init__(self):
        object.__setattr__(self, "staircase", self._build_staircase())

    @classmethod
    def of(cls, r: float, skew: float) -> "TypeIVLaw":
        """The law of r = 6 (kurtosis - skew^2 - 1)/(2 kurtosis - 3 skew^2 - 6), skew > 0, 16 (r-1) > skew^2 (r-2)^2."""
        scale = 0.25 * sqrt(16.0 * (r - 1.0) - (skew * (r - 2.0)) ** 2)
        t0 = (r - 2.0) * skew / (4.0 * scale)
        w = complex(0.5 * r + 1.0, 0.5 * r * t0)  # m - i nu/2
        gammas = (
            2.0 * stirling_remainder(w)
            - stirling_remainder(r + 1.0)
            - log(abs(w))
            - 2.0 * (w * complex_log1p(-1.0 / w)).real
        )
        powers = 1.5 * log(r) - (r + 0.5) * log1p(1.0 / r)
        return cls(r, t0, scale, gammas + powers - 1.0 - 0.5 * log(8.0 * pi) - log(scale))

    @property
    def c(self) -> complex:
        """c of 1 + c z."""
        return complex(self.t0, 1.0) / (self.scale * (1.0 + self.t0**2))

    def logpdf(self, z: Array) -> Array:
        """Log-density."""
        c = self.c
        modulus = np.log1p(z * (2.0 * c.real + (c.real**2 + c.imag**2) * z))  # log |1 + c z|^2
        angle = np.arctan2(c.imag * z, 1.0 + c.real * z)
        return self.constant - (0.5 * self.r + 1.0) * modulus + (self.r * self.t0) * angle

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws."""
        draws = np.empty(size)
        flat = draws.reshape(-1)  # a view
        count = 0
        while count < flat.size:
            psi = self._accepted(rng, flat.size - count)
            flat[count : count + psi.size] = psi
            count += psi.size
        tangent = np.tan(draws)
        return tangent / ((1.0 - self.t0 * tangent) * self.c.imag)

    def _accepted(self, rng: np.random.Generator, most: int) -> Array:
        """At most `most` draws of psi, seldom fewer."""
        stairs = self.staircase
        u = rng.random((2, most + most // 8 + 4))
        return accept(u, stairs.left, stairs.high, stairs.low, stairs.area, stairs.guide, self.r, self.t0)[:most]

    def _log_g(self, psi: ArrayLike) -> Array:
        cosine = -2.0 * np.square(np.sin(0.5 * np.asarray(psi))) - self.t0 * np.sin(psi)  # cos psi - t0 sin psi - 1
        return self.r * (np.log1p(np.maximum(cosine, _EDGE)) + self.t0 * np.asarray(psi))

    def _build_staircase(self) -> Staircase:
        start = 0.1 / sqrt(self.r * (1.0 + self.t0**2))  # a tenth of the standard deviation at the mode
        reach = start * 1.25 ** np.arange(200)
        last = atan2(1.0, self.t0)
        ends = []
        for sign, limit in ((-1.0, pi - last), (1.0, last)):
            inside = reach[reach < limit]
            cut = np.flatnonzero(self._log_g(sign * inside) < _LOG_CUT)
            ends.append(sign * (inside[cut[0]] if cut.size else limit))
        edges = np.concatenate([np.linspace(ends[0], 0.0, _STEPS + 1), np.linspace(0.0, ends[1], _STEPS + 1)[1:]])
        g = np.exp(self._log_g(edges))
        high = np.maximum(g[:-1], g[1:])
        area = np.concatenate([[0.0], np.cumsum(high * np.diff(edges))])
        guide = area[:-1].searchsorted(area[-1] * np.arange(_GUIDES) / _GUIDES, side="right") - 1
        return Staircase(edges[:-1], high, np.minimum(g[:-1], g[1:]), area, guide)
