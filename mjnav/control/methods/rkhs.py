"""`rkhs` and `rkhs-paper`: match each constraint's distribution with a collision-free one, in an RKHS.

With F_j(u) the distribution of the collision cone against obstacle j at candidate u, F_j^des that of a control that is
free of collisions, and D1, D2 the lane distances,

    u* = argmin_u  J(u) + lambda sum_j MMD^2(F_j(u), F_j^des) + sum_i lambda_i MMD^2(D_i(u), D_i^des)

(Nair et al., "Non Holonomic Collision Avoidance under Non-Parametric Uncertainty: A Hilbert Space Approach", arXiv
2112.13034). F^des are the samples at the nominal control that are safe; where too few are, safe samples of the nominal
controls for states within a ball around the mean join them; where none is, max(0, f) is matched with 0.
"""

from dataclasses import dataclass
from math import inf
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from mjnav.control.matching import MatchingController, MatchingParameters
from mjnav.control.parameters import LoopParameters
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array
from mjnav.rkhs.kernels import PolynomialKernel
from mjnav.rkhs.moments import moment_distance, raw_moments


@dataclass(frozen=True, slots=True, kw_only=True)
class RkhsParameters(MatchingParameters):
    """The kernel (scale x y + offset)^degree."""

    degree: int = 1
    scale: float = 1.0
    offset: float = 1.0

    def __post_init__(self):
        MatchingParameters.__post_init__(self)
        PolynomialKernel(self.degree, self.scale, self.offset)

    @property
    def kernel(self) -> PolynomialKernel:
        """The kernel."""
        return PolynomialKernel(self.degree, self.scale, self.offset)


# The literal method: what the paper does not have is switched off.
PAPER = MappingProxyType(
    {
        "form": "line",
        "degree": 3,
        "scale": 1.0,
        "offset": 1.0,
        "weight": 1.0,
        "lane_weights": (1.0, 1.0),
        "normalise": False,
        "clip": inf,
        "sensing_range": inf,
        "max_obstacles": 1_000_000,
        "desired_min": 0,
        "heading_weight": 0.0,
        "safety_margin": 0.0,
    }
)


class Rkhs(MatchingController[RkhsParameters]):
    """The candidate whose constraint distributions match collision-free ones best, against its goal cost."""

    parameters_type: ClassVar[type[LoopParameters]] = RkhsParameters

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """MMD^2 of every constraint."""
        p, c = self.parameters, problem.candidates
        # Both moments of order 0 are 1, so that term vanishes.
        coefficients = p.kernel.coefficients[1:]
        wanted = self.desired(problem)
        desired, sizes = wanted.cone_moments(p.degree)
        # Where nothing is safe, max(0, f) is matched with 0.
        moments = problem.cone.moments(c.v, c.omega, p.degree, sizes == 0)
        cone = moment_distance(moments, desired, coefficients)

        lane = np.zeros((len(c.v), 2))
        if problem.observation.lanes is not None:
            for side, samples in enumerate(problem.lanes):
                safe = wanted.lane(side)
                target = raw_moments(safe, p.degree)[1:] if len(safe) else np.zeros(p.degree)
                samples = samples if len(safe) else np.maximum(samples, 0.0)
                lane[:, side] = moment_distance(raw_moments(samples, p.degree)[:, 1:], target, coefficients)
        return cone, lane
