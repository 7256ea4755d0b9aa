"""What the compiled loops over constraint samples are given: named tuples of arrays and numbers."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array


class ConeBlocks(NamedTuple):
    """The discs and walls in reach, a block each, discs first: structure of arrays.

    Disc b has the samples start[b] ... start[b + 1] - 1, each of which makes a pair with each of the robot's N; a wall
    counts as one sample, and its two ends stand in `wall`.
    """

    column: NDArray[np.int64]  # (B,) the block's column in CandidateCosts.cone
    start: NDArray[np.int64]  # (B + 1,)
    num_discs: int
    position: Array  # (S, 2) [m] samples of the discs
    velocity: Array  # (S, 2) [m/s]
    radius_squared: Array  # (B,) R^2
    unit: Array  # (B,) what f is multiplied by
    wall: Array  # (B, 4) ax, ay, bx, by


class ConeRule(NamedTuple):
    """How f is computed: the form's number, time bounds [s], and the value below which f is cut off."""

    form: int
    horizon: float
    wall_horizon: float
    floor: float  # - clip, or -inf


class RobotSamples(NamedTuple):
    """N samples of the robot's state and of its actuation noise."""

    position: Array  # (N, 2) [m]
    speed_noise: Array  # (N,) [m/s] dv_i
    cos_heading: Array  # (N,) of theta_i + domega_i tau
    sin_heading: Array


class Controls(NamedTuple):
    """K controls."""

    v: Array  # (K,) [m/s]
    cos_turn: Array  # (K,) of omega tau
    sin_turn: Array
