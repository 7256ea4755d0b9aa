"""How mjnav compiles its scalar functions and the kernels that call them.

Sums may be reordered so that loops vectorise; infinities and NaN keep their meaning. The machine code is cached beside
the source. Numba looks only at the file of the function itself: after a change to a scalar function, its callers'
caches are stale (`rm -r mjnav/**/__pycache__`; the tests keep a cache for each state of the source).
"""

from collections.abc import Callable
from typing import Any

from numba import njit, vectorize

# "contract" allows fused multiply-add, "reassoc" vector sums, "arcp" reciprocals, "nsz" ignores the sign of zero.
FAST = frozenset({"contract", "reassoc", "arcp", "nsz"})


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a loop over arrays."""
    return njit(cache=True, fastmath=set(FAST), error_model="numpy", nogil=True)(function)


def exact(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a loop over arrays, every operation rounded as it is written: for indices and for draws that replay."""
    return njit(cache=True, error_model="numpy", nogil=True)(function)


def elementwise(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function of numbers into one of arrays that broadcast, as NumPy's own are."""
    return vectorize(nopython=True, cache=True)(function)


def scalar(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compiles a function of numbers into whatever kernel calls it."""
    return njit(cache=True, fastmath=set(FAST), error_model="numpy", inline="always")(function)
