"""`mmd-dirac`: the distance of max(0, f) from "no collision", a point mass at 0.

With x_i = max(0, f_i), weights alpha_i = 1/n and the Gaussian kernel k(x, y) = exp(-(x - y)^2 / (2 sigma^2)),

    MMD^2 = alpha' K_xx alpha - 2 alpha' k(x, 0) + 1.

Gupta, Singh & Krishna (2022); the risk of MMD-OPT, Sharma & Singh (2024, arXiv 2412.09121), too. One-sided: a control
is not charged for being safer than need be, and nothing where all samples are safe.

K_xx is never built. The kernel has the features phi_p(u) = exp(-u^2 / 2) u^p / sqrt(p!), p = 0, 1, 2, ... of
u = x / sigma, so that with m_p = sum_i alpha_i phi_p(u_i)

    MMD^2 = (1 - m_0)^2 + sum_{p>=1} m_p^2,

O(n P) for P terms. phi_p(u)^2 is the Poisson distribution of mean u^2: the sum ends where what is left of the largest
u's distribution is below TOLERANCE. A safe sample has u = 0 and adds to m_0 alone.

The largest u decides P. f / R^2 <= 1 bounds it; not normalised, or for a lane, nothing does. So u counts as
FARTHEST at most: as far from 0 as a kernel can tell to 1e-13, and P stays below 150. For bandwidth >= 1/8 no normalised
disc or wall reaches it.

The risk is a cost: every candidate may be chosen, and only `infeasible_nominal` can be reported.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.control.base import WeightedController, stored_risk
from mjnav.control.kernels.cone_blocks import Samples
from mjnav.control.parameters import GridParameters, LaneWeights, Positive, Weight
from mjnav.control.problem.problem import Problem
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Matrix, Vector
from mjnav.messages import Array

FARTHEST = 8.0  # bandwidths, beyond which samples are not told apart
TOLERANCE = 1e-10  # of the terms left out, as a share of k(x, x) = 1


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
        return stored_risk(problem, lambda f: _distances(f, self.parameters.bandwidth), hinge=True)


def distance_from_zero(samples: Array, bandwidth: float) -> Array:
    """MMD^2 of max(0, f) to a point mass at 0 for samples f (n, K), Gaussian kernel: (K,)."""
    return _distances(Samples.of(samples), bandwidth)


def _distances(samples: Samples, bandwidth: float) -> Array:
    out, (u, feature) = np.empty(samples.f.shape[1]), np.empty((2, len(samples.f)))
    _distance_from_zero(out, samples.f, samples.num, 1.0 / bandwidth, u, feature)
    return out


@kernel
def _distance_from_zero(out: Vector, samples: Matrix, num: int, per_unit: float, u: Vector, feature: Vector):
    for k in range(out.size):
        count = 0  # of unsafe samples, whose x / sigma stand first in u
        for i in range(samples.shape[0]):
            u[count] = samples[i, k] * per_unit
            count += samples[i, k] > 0.0
        largest, lost = 0.0, 0.0  # lost: what the unsafe samples lack in m_0
        for i in range(count):
            u[i] = min(u[i], FARTHEST)
            largest = max(largest, u[i])
            feature[i] = np.exp(-0.5 * u[i] * u[i])
            lost += 1.0 - feature[i]
        squares = (lost / num) ** 2
        # The Poisson probabilities of mean largest^2: from p = 2 largest^2 on, each is at most half of the one before.
        mean = largest * largest
        probability, p = np.exp(-mean), 0
        while count > 0 and (p < 2.0 * mean or probability > TOLERANCE):
            p += 1
            probability *= mean / p
            per_root, total = 1.0 / np.sqrt(p), 0.0
            for i in range(count):
                feature[i] *= u[i] * per_root
                total += feature[i]
            squares += (total / num) ** 2
        out[k] = squares
