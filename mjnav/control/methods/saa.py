"""`saa`: sample average approximation of the chance constraint.

    P(f <= 0) >= eta   becomes   (1/n) sum_i [f_i > 0] <= 1 - eta

for every disc, wall and lane: the share of colliding samples is bounded. Luedtke & Ahmed (2008), "A Sample
Approximation Approach for Optimization with Probabilistic Constraints"; a baseline of Sharma & Singh (2024, arXiv
2412.09121), "MMD-OPT: Maximum Mean Discrepancy Based Sample Efficient Collision Risk Minimization for Autonomous
Driving".

Where every candidate exceeds a bound, the decision is `infeasible`: the shares' excess, summed over the constraints, is
least. A share does not say by how much a sample collides, so where all samples of all candidates do, only the goal is
left to choose by. With a finite `penalty` the excess is a cost in place of a constraint.
"""

from dataclasses import dataclass
from math import inf
from typing import Annotated

import numpy as np

from mjnav.compile.compiled import Matrix, Vector, kernel
from mjnav.control.base import ConstrainedController, stored_risk
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.parameters import GridParameters, Penalty, Share
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class SaaParameters(GridParameters):
    """The candidates' parameters and the level of the chance constraint."""

    eta: Annotated[Share, "the least share of safe samples; 0 allows everything"] = 0.95
    penalty: Penalty = inf


class Saa(ConstrainedController[SaaParameters]):
    """The cheapest candidate whose share of colliding samples is at most 1 - eta for every constraint."""

    @property
    def bound(self) -> float:
        """1 - eta."""
        return round(1.0 - self.parameters.eta, 12)  # 1 - 0.9 is less than 0.1, and a share of 1 in 10 is allowed

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """The share of colliding samples of every constraint."""
        return stored_risk(problem, colliding_share, hinge=True)


def colliding_share(samples: Samples) -> Array:
    """The share of samples (n, K) above 0, (K,)."""
    count = np.zeros(samples.f.shape[1])
    _count_colliding(count, samples.f)
    return count / samples.num


@kernel
def _count_colliding(count: Vector, samples: Matrix):
    for i in range(samples.shape[0]):
        f = samples[i]
        for k in range(f.size):
            count[k] += 1.0 if f[k] > 0.0 else 0.0
