"""What a noise distribution offers, and the checks of its arguments."""

from collections.abc import Sequence
from numbers import Real
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from mjnav.errors import InvalidValue
from mjnav.messages import Array

MOST = 1e9  # of an argument: its square times the squares of its neighbours still is a float
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


def check_number(key: str, value: object, *, above: float | None = None) -> float:
    """`value` as a float; refuses what is not a number within MOST of 0, or not greater than `above`."""
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:  # an integer beyond the largest float
            number = np.inf
        if abs(number) <= MOST and (above is None or number > above):
            return number
    more = "" if above is None else f" > {above:g}"
    raise InvalidValue(key, value, f"a finite number{more}, of at most {MOST:g}")


def check_numbers(key: str, values: object, *, above: float | None = None, least: int = 1) -> tuple[float, ...]:
    """`values` as a tuple of floats; refuses fewer than `least` of them, and what `check_number` refuses."""
    if isinstance(values, np.ndarray):
        values = values.tolist()
    if not isinstance(values, Sequence) or isinstance(values, str | bytes) or len(values) < least:
        raise InvalidValue(key, values, f"a list of {least} or more numbers")
    return tuple(check_number(f"{key}.{i}", value, above=above) for i, value in enumerate(values))
