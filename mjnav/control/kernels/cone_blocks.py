"""The arguments of the compiled loops over constraint samples: named tuples of arrays and numbers."""

from typing import NamedTuple

import numpy as np

from mjnav.geometry.kernel_types import Indices, Matrix, Vector
from mjnav.messages import Array


class ConeBlocks(NamedTuple):
    """The discs and walls in reach, a block each, discs first: structure of arrays.

    Disc b has the samples start[b] ... start[b + 1] - 1, each of which makes a pair with each of the robot's N; a wall
    counts as one sample, and its two ends are in `wall`.
    """

    column: Indices  # (B,) the block's column in CandidateCosts.cone
    start: Indices  # (B + 1,)
    num_discs: int
    position: Matrix  # (S, 2) [m] samples of the discs
    velocity: Matrix  # (S, 2) [m/s]
    radius_squared: Vector  # (B,) R^2
    unit: Vector  # (B,) what f is multiplied by
    wall: Matrix  # (B, 4) ax, ay, bx, by


class ConeRule(NamedTuple):
    """How f is computed: the form's number, time bounds [s], and the value below which f is cut off."""

    form: int
    horizon: float
    wall_horizon: float
    floor: float  # - clip, or -inf


class RobotSamples(NamedTuple):
    """N samples of the robot's state and of its actuation noise."""

    position: Matrix  # (N, 2) [m]
    speed_noise: Vector  # (N,) [m/s] dv_i
    cos_heading: Vector  # (N,) of theta_i + domega_i tau
    sin_heading: Vector


class Controls(NamedTuple):
    """K controls."""

    v: Vector  # (K,) [m/s]
    cos_turn: Vector  # (K,) of omega tau
    sin_turn: Vector


class Samples(NamedTuple):
    """The samples of one constraint, (n, K) in whole: only rows that are not at the floor at all controls are stored.

    In a crowd these are few: most pairs of samples cannot meet whatever the control. Where none is stored, K may be 1:
    one control stands for all.
    """

    f: Matrix  # (s, K) the rows that are stored, in their order
    row: Indices  # (s,) their numbers, from 0 to n - 1
    num: int  # n
    floor: float

    @classmethod
    def of(cls, samples: Array) -> "Samples":
        """All of the samples (n, K)."""
        return cls(np.ascontiguousarray(samples), np.arange(len(samples)), len(samples), 0.0)

    def whole(self) -> Array:
        """All samples, (n, K)."""
        whole = np.full((self.num, self.f.shape[1]), self.floor)
        whole[self.row] = self.f
        return whole
