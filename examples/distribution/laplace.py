"""A noise distribution: Laplace, sharper in the middle and heavier in the tails than a Gaussian of the same std.

    mjnav run laplace.toml

A distribution is the dataclass of its parameters, with the members below. The world draws from it; the estimators
weigh by `logpdf`, which has to be the exact logarithm of the density of what `sample` draws.
"""

from dataclasses import dataclass
from math import inf, log, sqrt
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from mjnav.settings import Range, settle

Size = int | tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Laplace:
    """p(x) = exp(-|x - mean| / b) / (2 b), b = std / sqrt(2)."""

    mean: Annotated[float, Range(-100.0, 100.0), "in the channel's unit"] = 0.0
    std: Annotated[float, Range(1e-6, 100.0), "in the channel's unit"]

    def __post_init__(self):
        settle(self)

    @property
    def support(self) -> tuple[float, float]:
        """The real line."""
        return -inf, inf

    def sample(self, rng: np.random.Generator, size: Size) -> np.ndarray:
        """Independent draws of shape `size`; from `rng` alone, so that the same seed gives the same run."""
        return rng.laplace(self.mean, self.std / sqrt(2.0), size)

    def logpdf(self, x: ArrayLike) -> np.ndarray:
        """Natural logarithm of the density at `x`, of the same shape."""
        b = self.std / sqrt(2.0)
        return -np.abs(np.asarray(x, float) - self.mean) / b - log(2.0 * b)
