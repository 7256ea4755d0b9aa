"""The types of kernels' arguments, as annotations: `def pose_errors(measured: Vector, poses: Matrix)`.

A kernel whose arguments are all annotated can be compiled, or its machine code loaded, before it is first called.
Besides these, an argument may be a float, int or bool, a tuple of them, or a named tuple with fields of such types.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numba import types


@dataclass(frozen=True, slots=True)
class Contiguous:
    """An array whose numbers lie one after another; no type of numba's, which takes a second to import."""

    numbers: str  # numba's name of their type
    ndim: int
    readonly: bool = False


Vector = Annotated[NDArray[np.float64], Contiguous("float64", 1)]  # (n,)
Matrix = Annotated[NDArray[np.float64], Contiguous("float64", 2)]
Cube = Annotated[NDArray[np.float64], Contiguous("float64", 3)]
Indices = Annotated[NDArray[np.int64], Contiguous("int64", 1)]
ReadOnlyVector = Annotated[NDArray[np.float64], Contiguous("float64", 1, readonly=True)]
ReadOnlyMatrix = Annotated[NDArray[np.float64], Contiguous("float64", 2, readonly=True)]
ReadOnlyCube = Annotated[NDArray[np.float64], Contiguous("float64", 3, readonly=True)]
Flags = Annotated[NDArray[np.bool_], Contiguous("boolean", 1)]

_NUMBERS = {float: "float64", int: "int64", bool: "boolean"}


def declared(function: Callable[..., Any]) -> tuple["types.Type", ...] | None:
    """Numba's types of a function's arguments; None where not every argument is annotated."""
    code = function.__code__
    names = code.co_varnames[: code.co_argcount]
    if not names or not all(name in function.__annotations__ for name in names):
        return None
    hints = get_type_hints(function, include_extras=True)
    return tuple(_numba_type(hints[name]) for name in names)


def _numba_type(hint: Any) -> "types.Type":
    from numba import types

    if hint in _NUMBERS:
        return getattr(types, _NUMBERS[hint])
    if get_origin(hint) is Annotated:
        layout = get_args(hint)[1]
        return types.Array(getattr(types, layout.numbers), layout.ndim, "C", readonly=layout.readonly)
    if get_origin(hint) is tuple:
        return types.Tuple([_numba_type(part) for part in get_args(hint)])
    if hasattr(hint, "_fields"):
        parts = get_type_hints(hint, include_extras=True)
        kind = [_numba_type(parts[field]) for field in hint._fields]
        alike = all(part == kind[0] for part in kind)
        return types.NamedUniTuple(kind[0], len(kind), hint) if alike else types.NamedTuple(kind, hint)
    raise TypeError(f"an annotation that is no type of a kernel's arguments: {hint!r}")
