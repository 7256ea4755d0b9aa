"""Stretches of successive ticks at which something holds."""

import numpy as np
from numpy.typing import NDArray


def stretches(holds: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The first tick of each stretch of `holds` (T,), and the tick after its last, (n, 2)."""
    edges = np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])
