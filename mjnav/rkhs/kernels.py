"""The polynomial kernel k(x, y) = (scale x y + offset)^degree on the real line."""

from dataclasses import dataclass
from math import comb
from numbers import Integral

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.messages import Array

LEAST, MOST = 1e-9, 1e6  # of scale and offset: to the tenth power, times samples to the twentieth, still a float


@dataclass(frozen=True, slots=True)
class PolynomialKernel:
    """k(x, y) = (scale x y + offset)^degree with scale > 0 and offset > 0.

    Its feature map is finite: phi_p(x) = sqrt(c_p) x^p for p = 0 ... degree, c_p = C(degree, p) scale^p
    offset^(degree - p). So degree 1 sees means only, degree 2 variances too, degree 3 skew too.
    """

    degree: int
    scale: float = 1.0
    offset: float = 1.0

    def __post_init__(self):
        if not isinstance(self.degree, Integral) or isinstance(self.degree, bool) or not 1 <= self.degree <= 10:
            raise InvalidValue("degree", self.degree, "a whole number from 1 to 10")
        for name in ("scale", "offset"):
            if not LEAST <= getattr(self, name) <= MOST:
                raise InvalidValue(name, getattr(self, name), f"a finite number > 0, from {LEAST:g} to {MOST:g}")

    @property
    def coefficients(self) -> Array:
        """c_p for p = 0 ... degree, (degree + 1,)."""
        d = int(self.degree)
        return np.array([comb(d, p) * self.scale**p * self.offset ** (d - p) for p in range(d + 1)])

    def gram(self, x: Array, y: Array) -> Array:
        """K_ij = k(x_i, y_j) for x (n,) and y (m,): (n, m)."""
        return (self.scale * np.outer(x, y) + self.offset) ** self.degree
