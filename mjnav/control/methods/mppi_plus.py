"""`mppi-plus`: the rollouts and the other costs of `mjnav.control.planner`, with the risk of `mppi`.

The rollouts, the progress and the effort are the planner's; the risk is `mppi`'s,

    risk_k = weight sum_j sum_t P_jt dt  +  sum_i lambda_i sum_t P_it dt,

expected times in collision with every obstacle j, and beyond either lane boundary i (`problem.mppi_risk`). What sets
`rkhs-plan` apart from it is the risk, and the weights of the other costs, which were tuned for each.

A rollout is feasible where at no step the probability of a collision, or of being beyond a boundary, exceeds
`risk_bound`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.control.parameters import MOST, LaneWeights, Share, Weight
from mjnav.control.planner import Planner, PlannerParameters, Risks
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.mppi_risk import Surroundings
from mjnav.control.problem.obstacles import Reach
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import Rollouts
from mjnav.settings import Range


@dataclass(frozen=True, slots=True, kw_only=True)
class MppiPlusParameters(PlannerParameters):
    """The planner's parameters and the weights of the risk, as tuning found them best."""

    goal_weight: Annotated[Weight, "w_J, of the mean goal cost"] = 0.191
    progress_weight: Annotated[Weight, "w_P, of the way that is left"] = 2.76
    effort_weight: Annotated[Weight, "w_E, of the control cost"] = 0.263
    risk_bound: Annotated[Share, "probability of a collision, at any one step, above which a plan is infeasible"] = 0.1
    safety_margin: Annotated[float, Range(0.0, MOST, "m"), "added to the combined radius R"] = 0.0835
    weight: Annotated[Weight, "lambda, per second of expected collision with each disc and wall"] = 20.9
    lane_weights: LaneWeights = (10.0, 10.0)  # [1/s] of the expected time beyond each


class MppiPlus(Planner[MppiPlusParameters]):
    """Plans by the expected time in collision."""

    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """The weighted expected times, and the greatest probability at any one step."""
        p = self.parameters
        surroundings = Surroundings.of(problem, reach, len(samples.times), p.step)

        def risks(rollouts: Rollouts) -> Risks:
            risk = surroundings.risk(rollouts)
            cost = p.weight * risk.cone.sum(axis=1) + risk.lane @ np.array(p.lane_weights)
            return Risks(cost, risk.worst, np.zeros((len(cost), 0)))

        return risks
