"""The desired distributions F^des and D^des of one decision: samples of f that are free of collisions.

    F_j^des = {f <= 0 among the samples of F_j(u_nominal)}

Where these are fewer than `least`, the safe samples of the nominal controls for mean positions on a circle around the
mean join them (the ball of Nair et al., arXiv 2112.13034). The set may stay empty.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjnav.control.problem.problem import Problem
from mjnav.messages import Array

NUM_DIRECTIONS = 8  # mean positions, at the ball's radius


@dataclass(frozen=True)
class Desired:
    """The desired samples of each constraint of a problem."""

    problem: Problem
    least: int
    ball: float  # [m]

    def samples(self, block: int) -> Array:
        """F^des of one disc or wall, (n,)."""
        c = self.problem.candidates
        return self._safe(lambda ks: self.problem.cone.samples(block, c.v[ks], c.omega[ks]).T)

    def raw_moments(self, degree: int) -> tuple[Array, NDArray[np.int64]]:
        """Means of f^p, p = 1 ... degree, over F^des of every disc and wall, (B, degree), and its sizes (B,).

        Those of `samples`, for all blocks at once; 0 where the set is empty.
        """
        c, cone = self.problem.candidates, self.problem.cone
        num_blocks = len(cone.blocks.column)
        sums, sizes = np.zeros((num_blocks, degree)), np.zeros(num_blocks, np.int64)
        nominal = [self.problem.nominal]
        cone.add_safe(sums, sizes, np.ones(num_blocks, bool), c.v[nominal], c.omega[nominal])
        few = sizes < self.least
        if few.any():
            beside = list(self._beside)
            cone.add_safe(sums, sizes, few, c.v[beside], c.omega[beside])
        return sums / np.maximum(sizes, 1)[:, None], sizes

    def lane(self, side: int) -> Array:
        """D^des of the left (0) or right (1) boundary, (n,)."""
        return self._safe(lambda ks: self.problem.lanes[side, ks])

    def _safe(self, samples_at: Callable[[list[int]], Array]) -> Array:
        """The safe ones of the samples that candidates ks have, given as (K, n)."""
        samples = samples_at([self.problem.nominal])
        safe = samples[samples <= 0.0]
        if len(safe) >= self.least or not self._beside:
            return safe
        samples = samples_at(list(self._beside))
        return np.concatenate([safe, samples[samples <= 0.0]])

    @cached_property
    def _beside(self) -> tuple[int, ...]:
        """The nominal controls on the circle, each once, without the nominal control itself."""
        # From the heading on, so that a turned world gives the same decision.
        angles = self.problem.mean_pose[2] + 2.0 * np.pi * np.arange(NUM_DIRECTIONS) / NUM_DIRECTIONS
        shifts = self.ball * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return tuple(sorted(set(self.problem.nominals_at(shifts)) - {self.problem.nominal}))
