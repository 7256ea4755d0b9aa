"""The candidates of a tick as a page keeps them: the window that they cover, and the rank of each in eight levels.

A log has every candidate as a drawn arc. On a regular grid over (v, omega) the ranks alone say all; of a method whose
candidates lie otherwise, some are kept with their own controls.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from mjnav.messages import Array
from mjnav.recording.encode.candidates import PREVIEW, CandidateArcs

TOLERANCE = 0.004  # [m] between the end of a grid's arc and that of the nearest one in the log, which are rounded
MIN_CHORD = 0.1  # [m] of an arc whose turn rate can be told from where it ends
MAX_FREE = 96  # arcs kept of candidates that are no grid
NONE = 255  # where there is no arc

Bytes = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class CandidateRanks:
    """One tick's. `level` goes from 0, the cheapest eighth, to 7."""

    window: Array  # (4,) lowest and highest v [m/s], lowest and highest omega [rad/s]
    level: Bytes  # (num_v * num_omega,) of a grid, omega fastest; else (n,)
    free: Bytes | None = None  # (n, 2) shares of the window in 255ths; None for a grid


def candidate_ranks(arcs: CandidateArcs, heading: float, shape: tuple[int, int]) -> CandidateRanks | None:
    """The ranks of arcs drawn from a pose with `heading` [rad].

    `shape` is the grid that they may be, (num_v, num_omega). None where the robot cannot move and no arc has a length.
    """
    relative = (arcs.ends - arcs.start) @ _turn(heading)
    v, omega = _controls(relative)
    long = np.abs(v) > MIN_CHORD
    if not long.any():
        return None
    window = np.array([v.min(), v.max(), omega[long].min(), omega[long].max()])
    num_v, num_omega = shape
    if len(v) == num_v * num_omega + 2:  # keep and brake
        low_v, high_v, low_omega, high_omega = window.tolist()
        grid_v = np.repeat(np.linspace(low_v, high_v, num_v), num_omega)
        grid_omega = np.tile(np.linspace(low_omega, high_omega, num_omega), num_v)
        distance, nearest = KDTree(relative).query(_ends(grid_v, grid_omega))
        if distance.max() <= TOLERANCE:
            return CandidateRanks(window, arcs.level[nearest])
    kept = np.linspace(0, len(v) - 1, min(len(v), MAX_FREE)).astype(int)  # they stand in the order of cost
    low, size = window[[0, 2]], np.maximum(window[[1, 3]] - window[[0, 2]], 1e-9)
    shares = (np.stack([v, omega], axis=-1)[kept] - low) / size
    return CandidateRanks(window, arcs.level[kept], np.rint(255 * np.clip(shares, 0.0, 1.0)).astype(np.uint8))


def _turn(heading: float) -> Array:
    """Turns rows in the world's frame into the robot's."""
    cosine, sine = np.cos(heading), np.sin(heading)
    return np.array([[cosine, -sine], [sine, cosine]])


def _ends(v: Array, omega: Array) -> Array:
    """Where arcs of PREVIEW seconds end, (n, 2), in the frame of the robot at their start."""
    half = 0.5 * PREVIEW * omega
    chord = PREVIEW * v * np.sinc(half / np.pi)
    return np.stack([chord * np.cos(half), chord * np.sin(half)], axis=-1)


def _controls(ends: Array) -> tuple[Array, Array]:
    """The inverse: v and omega, each (n,). An end behind the robot is taken for one of driving backwards."""
    sign = np.where(ends[:, 0] < 0.0, -1.0, 1.0)
    half = np.arctan2(sign * ends[:, 1], sign * ends[:, 0])
    v = sign * np.hypot(*ends.T) / (PREVIEW * np.sinc(half / np.pi))
    return v, 2.0 * half / PREVIEW
