"""`mmd-dirac`: the distance of max(0, f) from "no collision", a point mass at 0.

The risk is MMD^2 under a Gaussian kernel (`rkhs/mmd.py`; its terms are in `rkhs/gaussian.py`). Gupta, Singh & Krishna
(2022); the risk of MMD-OPT, Sharma & Singh (2024, arXiv 2412.09121), too. One-sided: a control is not charged for being
safer than need be, and nothing where all samples are safe.

f / R^2 <= 1 bounds how far a sample is from 0; not normalised, or for a lane, nothing does. So a sample counts as 8
bandwidths from 0 at most. For bandwidth >= 1/8 no normalised disc or wall reaches that.

The risk is a cost: every candidate may be chosen, and only `infeasible_nominal` can be reported.
"""

from dataclasses import dataclass
from typing import Annotated

from mjnav.control.base import WeightedController, stored_risk
from mjnav.control.parameters import GridParameters, LaneWeights, Positive, Weight
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array
from mjnav.rkhs.gaussian import gaussian_mmd_squared


@dataclass(frozen=True, slots=True, kw_only=True)
class MmdDiracParameters(GridParameters):
    """The candidates' parameters, the risk's weights, and the kernel."""

    weight: Annotated[Weight, "lambda, of the risk of each disc and wall"] = 100.0
    lane_weights: LaneWeights = (10.0, 10.0)
    bandwidth: Annotated[Positive, "sigma of the Gaussian kernel, in the unit of f: R² where normalised"] = 1.0


class MmdDirac(WeightedController[MmdDiracParameters]):
    """The candidate whose constraint violations are nearest to none, against its goal cost."""

    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """MMD^2 of max(0, f) to a point mass at 0, for every constraint."""
        bandwidth = self.parameters.bandwidth
        return stored_risk(problem, lambda samples: gaussian_mmd_squared(samples.f, samples.num, bandwidth), hinge=True)
