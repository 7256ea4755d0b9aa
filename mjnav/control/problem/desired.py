"""The desired distributions F^des and D^des of one decision.

The samples at the nominal control that are safe. Where fewer than `least` are, safe samples of the nominal controls for
mean positions within a ball around the mean join them (the ball of Nair et al., arXiv 2112.13034). None at all: empty.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjnav.control.problem.problem import Problem
from mjnav.messages import Array

NUM_DIRECTIONS = 8  # mean positions looked at, on the ball's edge


@dataclass(frozen=True)
class Desired:
    """The desired samples of each constraint of a problem."""

    problem: Problem
    least: int
    ball: float  # [m]

    def cone(self, block: int) -> Array:
        """F^des of one disc or wall, (n,)."""
        c = self.problem.candidates
        return self._safe(lambda ks: self.problem.cone.samples(block, c.v[ks], c.omega[ks]).T)

    def cone_moments(self, degree: int) -> tuple[Array, NDArray[np.int64]]:
        """Means of f^p, p = 1 ... degree, over F^des of every disc and wall, (B, degree), and its sizes (B,).

        The moments of `cone` for all blocks at once; 0 where the set is empty.
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
        """What is safe of the samples at candidates, given as (K, n)."""
        samples = samples_at([self.problem.nominal])
        safe = samples[samples <= 0.0]
        if len(safe) >= self.least or not self._beside:
            return safe
        samples = samples_at(list(self._beside))
        return np.concatenate([safe, samples[samples <= 0.0]])

    @cached_property
    def _beside(self) -> tuple[int, ...]:
        """The nominal controls beside the mean, each once, without the nominal control itself."""
        # From the heading on, so that a turned world gives the same decision.
        angles = self.problem.mean_pose[2] + 2.0 * np.pi * np.arange(NUM_DIRECTIONS) / NUM_DIRECTIONS
        shifts = self.ball * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        return tuple(sorted(set(self.problem.nominals_at(shifts)) - {self.problem.nominal}))
