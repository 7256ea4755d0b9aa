"""How mjnav compiles its scalar functions and the kernels that call them.

Sums may be reordered so that loops vectorise; infinities and NaN keep their meaning. The machine code is kept in the
user's cache folder, under a digest of all that was compiled into it (`kernel_cache`). A kernel whose arguments are
annotated (`kernel_types`) is compiled or loaded for these types by `load_kernels`, before a run, and not at a tick.

Kernels that a kernel calls are inlined into its machine code (`forceinline`), so that a process that compiles computes
the same last bits as one that loads. Without this, the caller's machine code has a copy of each of them as a weak
symbol, which is optimised otherwise than the original. The process that compiled the original calls it from there; a
process that loads the caller alone calls the copy.
"""

# pyright: reportAttributeAccessIssue=false
# numba's modules carry no types.

import sys
from collections.abc import Callable
from typing import Any

from numba import njit, vectorize
from numba.core.dispatcher import Dispatcher
from numba.np.ufunc.dufunc import DUFunc

from mjnav.geometry.kernel_cache import KernelCache
from mjnav.geometry.kernel_code import processor as processor
from mjnav.geometry.kernel_types import declared

# "contract" allows fused multiply-add, "reassoc" vector sums, "arcp" reciprocals, "nsz" ignores the sign of zero.
FAST = frozenset({"contract", "reassoc", "arcp", "nsz"})


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a loop over arrays."""
    return _cached(njit(fastmath=set(FAST), error_model="numpy", nogil=True, forceinline=True)(function))


def exact(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a loop over arrays, every operation rounded as it is written: for indices and for draws that replay."""
    return _cached(njit(error_model="numpy", nogil=True, forceinline=True)(function))


def elementwise(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function of numbers into one of arrays that broadcast, as NumPy's own are."""
    compiled = vectorize(nopython=True)(function)
    dispatcher = compiled._dispatcher
    dispatcher.cache = KernelCache(dispatcher.py_func, dispatcher.targetoptions)
    return compiled


def scalar(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function of numbers, inlined into the kernels that call it."""
    return _cached(njit(fastmath=set(FAST), error_model="numpy", inline="always")(function))


def load_kernels() -> None:
    """Loads, or compiles, every kernel with annotated arguments in the modules of mjnav that are imported."""
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("mjnav.")]
    for value in {id(value): value for module in modules for value in list(vars(module).values())}.values():
        if isinstance(value, Dispatcher):
            _load(value, value._cache, value.compile)
        elif isinstance(value, DUFunc):
            _load(value._dispatcher, value._dispatcher.cache, value.add)


def _load(dispatcher: Any, cache: KernelCache, compile_for: Callable[[Any], Any]) -> None:
    arguments = declared(dispatcher.py_func)
    known = {getattr(signature, "args", signature) for signature in dispatcher.overloads}
    if arguments is not None and arguments not in known:
        with cache.making(arguments):
            compile_for(arguments)


def _cached(compiled: Callable[..., Any]) -> Callable[..., Any]:
    if isinstance(compiled, Dispatcher):  # a plain function under NUMBA_DISABLE_JIT
        compiled._cache = KernelCache(compiled.py_func, compiled.targetoptions)
    return compiled
