"""The interface of noise distributions, arguments that several share, and the check of a user's own distribution.

A user's own is checked where it is made and wherever it is drawn from. The world and the estimators take what it gives
without a further look, so what is no noise has to be told here.
"""

from math import inf
from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue, PluginFault, own_code, said
from mjnav.messages import LARGEST, Array, real
from mjnav.settings import Range
from mjnav.settings.plugins import DistributionPlugin

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


class Checked:
    """A user's distribution: its mean, std and support are those at the start, its draws numbers up to LARGEST."""

    def __init__(self, name: str, distribution: Any):
        self._name, self._own = name, distribution
        allowed = "a distribution whose mean, std and support (low, high) are numbers"
        with own_code(lambda error: InvalidValue("distribution", name, f"{allowed} ({said(error)})")):
            self.mean, self.std = float(distribution.mean), float(distribution.std)
            low, high = map(float, distribution.support)
        self.support = low, high
        if not (abs(self.mean) <= LARGEST and 0.0 <= self.std <= LARGEST and low <= high):
            found = f"{name}: mean {self.mean}, std {self.std}, support {self.support}"
            allowed = f"a mean and a std >= 0, of at most {LARGEST:g}, and support from low to high"
            raise InvalidValue("distribution", found, allowed)

    def sample(self, rng: np.random.Generator, size: Size) -> Array:
        """See `Distribution`. Raises PluginFault for draws of another shape, and for those that are too far away."""
        with PluginFault.told(self._name, "sample()"):
            drawn = real(self._own.sample(rng, size))
        shape = (size,) if isinstance(size, int) else tuple(size)
        if drawn.shape != shape:
            raise PluginFault(f"{self._name}: sample() gave draws of shape {drawn.shape} in place of {shape}")
        far = ~(np.abs(drawn) <= LARGEST)
        if far.any():
            raise PluginFault(f"{self._name}: sample() gave {drawn[far][0]}; a draw is a number up to {LARGEST:g}")
        return drawn

    def logpdf(self, x: ArrayLike) -> Array:
        """See `Distribution`. Raises PluginFault for another shape, and for NaN."""
        x = np.array(x, float)
        with PluginFault.told(self._name, "logpdf()"):
            found = real(self._own.logpdf(x.copy()))
        if found.shape != x.shape:
            raise PluginFault(f"{self._name}: logpdf() gave shape {found.shape} for x of shape {x.shape}")
        if np.isnan(found).any():
            raise PluginFault(f"{self._name}: logpdf() gave NaN")
        return found


def made(distribution: Distribution | DistributionPlugin) -> Distribution:
    """The distribution of a channel; one of a user's own is imported, made and checked. Raises InvalidValue."""
    if isinstance(distribution, DistributionPlugin):
        return Checked(distribution.name, distribution.make())
    return distribution
