"""What a noise distribution offers, and the arguments that several have."""

from math import inf
from typing import Annotated, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mjnav.config import Range
from mjnav.messages import Array

MOST = 1e4  # of an argument in the channel's unit: as far as coordinates go
Mean = Annotated[float, Range(-MOST, MOST), "expectation, in the channel's unit"]
Spread = Annotated[float, Range(0.0, MOST, open_low=True), "standard deviation, in the channel's unit"]
Size = int | tuple[int, ...]


class Distribution(Protocol):
    """The noise of one channel, in the channel's unit."""

    @property
    def mean(self) -> float:
        """Its expectation."""
        ...

    @property
    def std(self) -> float:
        """Its standard deviation."""
        ...

    @property
    def support(self) -> tuple[float, float]:
        """The interval outside of which the density is zero."""
        ...

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """Independent draws of shape `size`."""
        ...

    def logpdf(self, x: ArrayLike) -> Array:
        """Natural logarithm of the density at `x`, of the same shape: -inf outside the support, never NaN or +inf."""
        ...


class OnRealLine:
    """A distribution whose density is positive everywhere."""

    __slots__ = ()

    @property
    def support(self) -> tuple[float, float]:
        """The real line."""
        return -inf, inf
