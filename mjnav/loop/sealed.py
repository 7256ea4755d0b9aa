"""Copies that cannot be written to, so that a controller or a watcher cannot change the run through what it is shown.

An array that owns its memory can always be made writable again; an array on immutable bytes cannot.
"""

from dataclasses import fields, is_dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import CandidateCosts

A = TypeVar("A", bound=np.generic)
T = TypeVar("T")


def sealed(array: NDArray[A]) -> NDArray[A]:
    """The same values, in the same order in memory, in a new array that cannot be made writable."""
    if array.flags.fnc:
        return np.frombuffer(array.tobytes("F"), array.dtype).reshape(array.shape, order="F")
    return np.frombuffer(array.tobytes(), array.dtype).reshape(array.shape)


def sealed_costs(costs: CandidateCosts) -> CandidateCosts:
    """The same, sealed: a controller may reuse its own arrays before the log has written them."""
    v, omega, goal, cone, lane, total = (
        sealed(np.asarray(values, float))
        for values in (costs.v, costs.omega, costs.goal, costs.cone, costs.lane, costs.total)
    )
    return CandidateCosts(v, omega, goal, cone, lane, total, int(costs.nominal))


def sealed_message(message: T) -> T:
    """A message of `mjnav.messages` with every array in it sealed."""
    return _sealed(message)


def _sealed(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return sealed(value)
    if isinstance(value, tuple):
        return tuple(map(_sealed, value))
    if is_dataclass(value):
        return type(value)(**{field.name: _sealed(getattr(value, field.name)) for field in fields(value)})
    return value
