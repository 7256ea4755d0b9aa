"""`rkhs-plan`: plans whose violations, under all that is uncertain together, are nearest to none.

A joint sample s is one draw of everything: where the robot is, how every person goes on, where the lanes run. Under it
rollout k has the violation

    h_s(k) = max over j, t of  gamma_jt min(2, [R_j + m_jt - d_jts(k)]_+ / m_jt)

of the worst moment and the worst obstacle (`kernels.violation`): of people m = margin + margin_growth t and gamma =
exp(-t / fading), as what is far ahead is less certain and can still be avoided; of what stands, and of lane boundaries,
m = standing_margin and gamma = 1.

The risk is the distance of the distribution of h from "nothing comes near", a point mass at 0, in the Hilbert space
of the kernel (x y + 1)^d:

    risk_k = MMD({h_s(k)}, 0) = sqrt(sum_{p=1..d} C(d, p) mu_p(k)^2),   mu_p = 1/S sum_s h_s^p

(the idea: Nair et al. 2021, arXiv 2112.13034; a point mass as what is desired: Gupta, Singh & Krishna 2022; MMD-OPT,
Sharma & Singh 2024). It joins the other costs of a rollout, see `mjnav.control.planner`.

A rollout is feasible where at most the share `risk_bound` of the samples has h_s >= 1: a contact soon, or at any time
with what stands.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.control.kernels.violation import touching
from mjnav.control.parameters import LEAST, MOST, Count, Seconds, Weight
from mjnav.control.planner import Planner, PlannerParameters, Risks
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import Rollouts
from mjnav.messages import Array, RobotLimits
from mjnav.rkhs.mmd import PolynomialKernel, distance_from_dirac
from mjnav.settings import Range

Margin = Annotated[float, Range(LEAST, MOST, "m")]


@dataclass(frozen=True, slots=True, kw_only=True)
class RkhsPlanParameters(PlannerParameters):
    """The violation and its distance from none."""

    samples: Annotated[Count, "S, number of joint samples"] = 48
    safety_margin: Annotated[float, Range(0.0, MOST, "m"), "added to the combined radius R"] = 0.0
    weight: Annotated[Weight, "lambda, of the risk"] = 5.0
    degree: Annotated[int, Range(1, 10), "d of the kernel (x y + 1)^d"] = 2
    margin: Annotated[Margin, "m of what moves, at the moment of effect"] = 0.15
    margin_growth: Annotated[float, Range(0.0, MOST, "m/s"), "by which the margin of what moves grows"] = 0.1
    standing_margin: Annotated[Margin, "m of what stands, and of lane boundaries"] = 0.052
    fading: Annotated[Seconds, "time in which violations by what moves fade to 1/e"] = 3.0


class RkhsPlan(Planner[RkhsPlanParameters]):
    """Plans by the distance of the violations' distribution from none."""

    def __init__(self, limits: RobotLimits, period: float, parameters: RkhsPlanParameters):
        super().__init__(limits, period, parameters)
        self._kernel = PolynomialKernel(parameters.degree)

    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """lambda times the distance of h from 0, P(h >= 1), and h."""

        def risks(rollouts: Rollouts) -> Risks:
            h = self.violation(samples, rollouts)
            return Risks(self.parameters.weight * self.distance(h), touching(h), h)

        return risks

    def violation(self, samples: JointSamples, rollouts: Rollouts) -> Array:
        """h (K, S)."""
        p, t = self.parameters, samples.times
        return samples.violation(rollouts, p.margin + p.margin_growth * t, np.exp(-t / p.fading), p.standing_margin)

    def distance(self, h: Array) -> Array:
        """Of violations (K, S) from none, (K,)."""
        return distance_from_dirac(h, self._kernel)
