"""`rkhs` and `rkhs-paper`: match each constraint's distribution with a collision-free one, in an RKHS.

With F_j(u) the distribution of the collision cone f against obstacle or wall j at candidate u, F_j^des that of a
control that is free of collisions, and D_1, D_2 the same of the lane distances,

    u* = argmin_u  J(u) + lambda sum_j MMD^2(F_j(u), F_j^des) + sum_i lambda_i MMD^2(D_i(u), D_i^des)

(Nair et al., "Non Holonomic Collision Avoidance under Non-Parametric Uncertainty: A Hilbert Space Approach", arXiv
2112.13034). By the name `rkhs` the distance is weighed (`root`), and not its square. To follow one decision, from here:

    control/base.py                  the sum and its argmin
    rkhs/mmd.py                      MMD^2 by raw moments
    control/problem/samples.py   F_j(u): f for all pairs of samples
    constraints/collision_cone.py    f

and beside the way control/problem/goal_cost.py for J and desired.py for F^des; samples.py has D as well.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.control.base import MatchingController
from mjnav.control.parameters import MatchingParameters, Positive
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array
from mjnav.rkhs.mmd import PolynomialKernel, moment_distance, raw_moments
from mjnav.settings import Range


@dataclass(frozen=True, slots=True, kw_only=True)
class RkhsParameters(MatchingParameters):
    """The kernel (scale x y + offset)^degree."""

    degree: Annotated[int, Range(1, 10), "d of the kernel (scale x y + offset)^d"] = 1
    scale: Annotated[Positive, "of the kernel"] = 1.0
    offset: Annotated[Positive, "of the kernel"] = 1.0
    root: Annotated[bool, "whether the risk is MMD in place of its square, which is flat where it vanishes"] = False

    @property
    def kernel(self) -> PolynomialKernel:
        """The kernel."""
        return PolynomialKernel(self.degree, self.scale, self.offset)


class Rkhs(MatchingController[RkhsParameters]):
    """The candidate whose constraint distributions match collision-free ones best, against its goal cost."""

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """MMD^2(F_j(u), F_j^des) of every disc and wall, (K, B), and MMD^2(D_i(u), D_i^des) of both lanes, (K, 2).

        With `root` their roots.
        """
        c, desired, kernel = problem.candidates, self.desired(problem), self.parameters.kernel

        # Where F^des is empty, max(0, f) is compared with 0.
        f_desired, num_desired = desired.raw_moments(kernel.degree)
        f = problem.cone.raw_moments(c.v, c.omega, kernel.degree, hinge=num_desired == 0)
        cone = moment_distance(f, f_desired, kernel)

        lane = np.zeros((len(c.v), 2))
        for side, d in enumerate(problem.lanes):
            d_desired = desired.lane(side)
            if not len(d_desired):
                d, d_desired = np.maximum(d, 0.0), np.zeros(1)
            lane[:, side] = moment_distance(
                raw_moments(d, kernel.degree), raw_moments(d_desired, kernel.degree), kernel
            )
        return (np.sqrt(cone), np.sqrt(lane)) if self.parameters.root else (cone, lane)
