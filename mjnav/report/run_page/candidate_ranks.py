"""The candidates of a tick as a page keeps them: the window that they cover, and the rank of each in eight levels.

Where the candidates are a grid over (v, omega), the window and the ranks are enough; of a method whose candidates lie
otherwise, some are kept with their own controls.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.recording.encode.candidate_arcs import NUM_LEVELS, level_bounds

MAX_FREE = 96  # arcs kept of candidates that are no grid
NONE = 255  # where there is no arc

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class CandidateRanks:
    """One tick's. `level` goes from 0, the cheapest eighth, to 7."""

    window: Array  # (4,) lowest and highest v [m/s], lowest and highest omega [rad/s]
    level: Bytes  # (num_v * num_omega,) of a grid, omega fastest; else (n,)
    free: Bytes | None = None  # (n, 2) shares of the window in 255ths; None for a grid


def candidate_ranks(v: Array, omega: Array, total: Array, shape: tuple[int, int]) -> CandidateRanks | None:
    """The ranks of the total costs of K candidates, each array (K,).

    `shape` is the grid that they may be, (num_v, num_omega), before keep and brake. None where the robot cannot move
    and no arc has a length. Raises ValueError where the arrays differ in length or are empty.
    """
    if not v.size == omega.size == total.size > 0:
        raise ValueError(f"{v.size} speeds, {omega.size} turn rates and {total.size} costs")
    if not v.any():
        return None
    order = np.argsort(total, kind="stable")
    level = np.empty(v.size, np.uint8)
    level[order] = np.repeat(np.arange(NUM_LEVELS, dtype=np.uint8), np.diff(level_bounds(v.size)))
    num_v, num_omega = shape
    if v.size == num_v * num_omega + 2:
        rows, columns = v[:-2].reshape(shape), omega[:-2].reshape(shape)
        if (rows == rows[:, :1]).all() and (columns == columns[:1]).all():
            return CandidateRanks(np.array([rows[0, 0], rows[-1, 0], columns[0, 0], columns[0, -1]]), level[:-2])
    window = np.array([v.min(), v.max(), omega.min(), omega.max()])
    kept = order[np.linspace(0, v.size - 1, min(v.size, MAX_FREE)).astype(int)]
    low, size = window[[0, 2]], np.maximum(window[[1, 3]] - window[[0, 2]], 1e-9)
    shares = (np.stack([v, omega], axis=-1)[kept] - low) / size
    return CandidateRanks(window, level[kept], np.rint(255 * np.clip(shares, 0.0, 1.0)).astype(np.uint8))
