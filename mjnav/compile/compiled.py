"""Compilation of scalar functions and kernels with numba, and the annotations that declare kernels' argument types.

A kernel declares its types as in `def pose_errors(measured: Vector, poses: Matrix)`. Where all arguments are annotated,
it can be compiled, or its machine code loaded, before it is first called; `load_kernels` does so before a run, not at a
tick. Besides the types of arrays below, an argument may be a float, int or bool, a tuple of them, or a named tuple with
fields of such types.

Sums may be reordered so that loops vectorise; infinities and NaN keep their meaning. The machine code is kept in the
user's cache folder, under a digest of all that was compiled into it (`kernel_cache`).

Kernels that a kernel calls are inlined into its machine code (`forceinline`), so that a process that compiles computes
the same last bits as one that loads. Without this, the caller's machine code has a copy of each of them as a weak
symbol, which is optimised otherwise than the original. The process that compiled the original calls it from there; a
process that loads the caller alone calls the copy.
"""

# pyright: reportAttributeAccessIssue=false
# numba's modules carry no types.

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, update_wrapper
from threading import Event
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numba import types

    from mjnav.compile.kernel_cache import KernelCache


# ------------------------------------------------------------------------------------- argument types


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


# ---------------------------------------------------------------------------------------- compilation


# "contract" allows fused multiply-add, "reassoc" vector sums, "arcp" reciprocals, "nsz" ignores the sign of zero.
FAST = frozenset({"contract", "reassoc", "arcp", "nsz"})
_in_use = Event()  # of numba: from then on functions are handed to it where they are defined


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a loop over arrays."""
    return _prepared(function, fastmath=set(FAST), error_model="numpy", nogil=True, forceinline=True)


def exact(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a loop over arrays, every operation rounded as it is written: for indices and for draws that replay."""
    return _prepared(function, error_model="numpy", nogil=True, forceinline=True)


def elementwise(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function of numbers into one of arrays that broadcast, as NumPy's own are."""
    return _prepared(function, elementwise=True)


def scalar(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function of numbers, inlined into the kernels that call it."""
    return _prepared(function, fastmath=set(FAST), error_model="numpy", inline="always")


class Unprepared:
    """A function that numba has not seen yet: whoever only reads names and parameters need not wait for numba.

    The first use of any of them imports numba and puts numba's own object in the place of each, in every module.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]):
        self._function, self._options = function, options
        update_wrapper(self, function)

    @cached_property
    def prepared(self) -> Any:
        """Numba's object."""
        return _of_numba(self._function, **self._options)

    def __call__(self, *arguments: Any) -> Any:
        """What numba's object gives."""
        prepare()
        return self.prepared(*arguments)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # asked for by copies and by whoever looks through a module
            raise AttributeError(name)
        prepare()
        return getattr(self.prepared, name)


def _prepared(function: Callable[..., Any], **options: Any) -> Any:
    return _of_numba(function, **options) if _in_use.is_set() else Unprepared(function, options)


def _of_numba(function: Callable[..., Any], *, elementwise: bool = False, **options: Any) -> Any:
    from numba import njit, vectorize

    from mjnav.compile.kernel_cache import KernelCache

    if elementwise:
        made = vectorize(nopython=True)(function)
        made._dispatcher.cache = KernelCache(made._dispatcher.py_func, made._dispatcher.targetoptions)
        return made
    made = njit(**options)(function)
    if made is not function:  # as it is under NUMBA_DISABLE_JIT
        made._cache = KernelCache(made.py_func, made.targetoptions)
    return made


def prepare() -> None:
    """Puts numba's object in the place of every function that waits for it, at the first call."""
    if _in_use.is_set():
        return
    _in_use.set()
    for names in [getattr(module, "__dict__", {}) for module in list(sys.modules.values())]:
        for name, value in list(names.items()):
            if type(value) is Unprepared:
                names[name] = value.prepared


def load_kernels() -> None:
    """Loads, or compiles, every kernel with annotated arguments in the modules of mjnav that are imported."""
    from numba.core.dispatcher import Dispatcher
    from numba.np.ufunc.dufunc import DUFunc

    prepare()
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("mjnav.")]
    for value in {id(value): value for module in modules for value in list(vars(module).values())}.values():
        if isinstance(value, Dispatcher):
            _load(value, value._cache, value.compile)
        elif isinstance(value, DUFunc):
            _load(value._dispatcher, value._dispatcher.cache, value.add)


def _load(dispatcher: Any, cache: "KernelCache", compile_for: Callable[[Any], Any]) -> None:
    arguments = declared(dispatcher.py_func)
    known = {getattr(signature, "args", signature) for signature in dispatcher.overloads}
    if arguments is not None and arguments not in known:
        with cache.making(arguments):
            compile_for(arguments)
