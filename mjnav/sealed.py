"""Copies at the border to a user's own code: what it is shown cannot be written to, what it returns is checked.

So neither a controller nor a watcher can change the run through what it is shown, or keep what it returned. An array
that owns its memory can always be made writable again; an array on immutable bytes cannot.
"""

from dataclasses import fields, is_dataclass
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import PluginFault
from mjnav.messages import Array, CandidateCosts, PlanShown, real

A = TypeVar("A", bound=np.generic)


def sealed(array: NDArray[A]) -> NDArray[A]:
    """The same values, in the same order in memory, in an array that cannot be made writable; a sealed one itself."""
    owner = array.base
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, bytes):
        return array
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


def sealed_plan(plan: PlanShown) -> PlanShown:
    """The same, sealed. Raises ValueError where its paths differ in length."""
    path, fan, cost, violation = (
        sealed(np.asarray(values, float)) for values in (plan.path, plan.fan, plan.fan_cost, plan.violation)
    )
    if path.shape[1:] != (2,) or fan.shape != (*cost.shape, *path.shape) or violation.ndim != 1:
        shapes = ", ".join(str(values.shape) for values in (path, fan, cost, violation))
        raise ValueError(f"a plan with path, fan, fan_cost and violation of shapes {shapes}")
    return PlanShown(float(plan.step), path, fan, cost, violation, bool(plan.feasible))


def checked_copy(what: str, values: Any, shape: tuple[int, ...]) -> Array:
    """An array that a plug-in returned, copied; `what` names it. Raises PluginFault for another shape, and for NaN."""
    try:
        copied = np.asarray(real(values), order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise PluginFault(f"{what} is no array of numbers ({error})") from None
    if copied.shape != shape:
        raise PluginFault(f"{what} has shape {copied.shape} in place of {shape}")
    if not np.isfinite(copied).all():
        raise PluginFault(f"{what} holds a number that is not finite")
    return copied


ATOMS = frozenset((float, int, bool, str, type(None)))


def sealed_message(part: Any) -> Any:
    """A message of `mjnav.messages`, or a part of one, with every array in it sealed, in objects of its own.

    Fields and shapes of these objects are their own, too; what is sealed already stays in the same memory.
    """
    if isinstance(part, np.ndarray):
        return sealed(part).view()
    kind, is_tuple = type(part), isinstance(part, tuple)
    values = part if is_tuple else [getattr(part, name) for name in _field_names(kind)]
    anew = [value if type(value) in ATOMS else sealed_message(value) for value in values]  # most are
    return tuple(anew) if is_tuple else kind(*anew) if anew else part


@lru_cache
def _field_names(kind: type) -> tuple[str, ...]:
    """The names of a dataclass's fields, in order; none for any other type."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else ()
