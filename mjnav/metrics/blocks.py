"""Long runs a few rows at a time, so that what is computed on the way takes little memory."""

from collections.abc import Callable

import numpy as np

from mjnav.messages import Array

ROWS = 4096


def by_blocks(function: Callable[..., Array], *columns: Array) -> Array:
    """The rows of function(*columns), for one that computes each row from the same row of its arguments alone."""
    starts = range(0, max(len(columns[0]), 1), ROWS)
    return np.concatenate([function(*(column[start : start + ROWS] for column in columns)) for start in starts])
