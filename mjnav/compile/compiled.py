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

A kernel copies rows number by number: `out[i] = row` compiles an error message, which takes seconds.
"""

# pyright: reportAttributeAccessIssue=false
# numba's modules carry no types.

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, update_wrapper
from importlib import import_module
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from numba import types


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
# No program in C calls a loop: without what it would be called by, compiling takes a twentieth less.
LOOP = MappingProxyType({"error_model": "numpy", "nogil": True, "forceinline": True, "no_cfunc_wrapper": True})


def kernel(function: Callable[..., Any]) -> Any:
    """Compiles a loop over arrays."""
    return Kernel(function, fastmath=set(FAST), **LOOP)


def exact(function: Callable[..., Any]) -> Any:
    """Compiles a loop over arrays, every operation rounded as it is written: for indices and for draws that replay."""
    return Kernel(function, **LOOP)


def scalar(function: Callable[..., Any]) -> Any:
    """Compiles a function of numbers, inlined into the kernels that call it."""
    return Kernel(function, fastmath=set(FAST), error_model="numpy", inline="always")


class Kernel:
    """A function that numba compiles at its first call; until then numba, which takes a second, is not imported.

    A kernel that calls another one has this object among its globals. Numba takes it for its own dispatcher, as it asks
    for `_numba_type_`, `py_func` and `targetoptions`.
    """

    def __init__(self, function: Callable[..., Any], **options: Any):
        self.py_func, self.targetoptions = function, options
        update_wrapper(self, function)

    @cached_property
    def compiled(self) -> Any:
        """Numba's dispatcher; the function itself under NUMBA_DISABLE_JIT."""
        from numba import njit

        from mjnav.compile.kernel_cache import KernelCache

        compiled = njit(**self.targetoptions)(self.py_func)
        if compiled is not self.py_func:
            compiled._cache = KernelCache(self.py_func, self.targetoptions)
        return compiled

    @property
    def _numba_type_(self) -> "types.Type":
        from numba.core.registry import cpu_target

        return cpu_target.typing_context.resolve_value_type(self.compiled)

    __call__: Any = property(attrgetter("compiled"))  # a call is numba's alone, without a frame of Python's between

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # asked for by copies and by whoever looks through a module
            raise AttributeError(name)
        return getattr(self.compiled, name)

    @property
    def lacking(self) -> bool:
        """Whether the machine code for the types that the annotations declare is still to be compiled and kept."""
        arguments = declared(self.py_func)
        if arguments is None or self.compiled is self.py_func:
            return False
        return self.compiled._cache.lacks(arguments)

    def load(self) -> None:
        """Loads, or compiles, the machine code for the types that the annotations declare, if they do."""
        arguments = declared(self.py_func)
        if arguments is not None and self.compiled is not self.py_func:
            self.compiled.compile(arguments)


MANY = 16  # kernels to compile, for which one more process pays: it takes a second to start


def load_kernels() -> None:
    """Loads, or compiles, every kernel with annotated arguments in the modules of mjnav that are imported."""
    for kernel in reversed(_kernels_of(_imported())):  # helpers come from the other end
        kernel.load()


@contextmanager
def helpers() -> Iterator[None]:
    """Where many kernels of the imported modules are lacking, other processes, one a processor, compile them meanwhile.

    They leave them in the cache, and end with the block: what they still compile then is there.
    """
    modules = _imported()
    lacking = sum(kernel.lacking for kernel in _kernels_of(modules))
    num = min(len(os.sched_getaffinity(0)) - 1, lacking // MANY) if sys.executable else 0
    started = [_helper(modules, i / num) for i in range(num)]
    try:
        yield
    finally:
        for helper in started:
            helper.kill()
            helper.wait()


def _imported() -> list[str]:
    return [name for name in list(sys.modules) if name.startswith("mjnav.")]


def _kernels_of(modules: Iterable[str]) -> list[Kernel]:
    """The kernels in these modules, each once, in the same order in every process."""
    values = [value for name in sorted(modules) for value in list(vars(import_module(name)).values())]
    return [value for value in {id(value): value for value in values}.values() if isinstance(value, Kernel)]


def compile_from(kernels: Sequence[Kernel], share: float) -> None:
    """Compiles the kernels that nobody has compiled yet, beginning after a `share` of them."""
    begin = int(share * len(kernels))
    for kernel in (*kernels[begin:], *kernels[:begin]):
        if kernel.lacking:
            kernel.load()


def _helper(modules: Sequence[str], share: float) -> "subprocess.Popen[bytes]":
    """A process that compiles with this one, and imports what this one imports from the same places."""
    program = (
        "import json, sys\n"
        "asked = json.loads(sys.argv[1])\n"
        "sys.path[:] = asked['path']\n"
        "from mjnav.compile import compiled\n"
        "compiled.compile_from(compiled._kernels_of(asked['modules']), asked['share'])\n"
    )
    asked = json.dumps({"path": sys.path, "modules": modules, "share": share})
    nothing = subprocess.DEVNULL
    return subprocess.Popen([sys.executable, "-c", program, asked], stdin=nothing, stdout=nothing, stderr=nothing)
