"""The cost of one decision as a function of any control: what a method that searches (v, omega) would minimise."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.control.methods.rkhs import Rkhs
from mjnav.control.problem.candidates import Candidates
from mjnav.control.problem.goal_cost import GoalCost
from mjnav.control.problem.problem import Problem
from mjnav.errors import InvalidValue
from mjnav.messages import Array, Observation
from mjnav.paper.decisions import variant
from mjnav.rkhs.mmd import moment_distance
from mjnav.scenarios.spec import Scenario

# name -> method, and which of its parameters are changed
VARIANTS: Mapping[str, tuple[str, Mapping[str, Any]]] = MappingProxyType(
    {
        "d = 1": ("rkhs", {"degree": 1}),
        "d = 2": ("rkhs", {"degree": 2}),
        "d = 3": ("rkhs", {"degree": 3}),
        "as published": ("rkhs-paper", {}),
    }
)
UNCLIPPED: Mapping[str, Any] = MappingProxyType({"degree": 3, "clip": inf})


@dataclass(frozen=True, slots=True)
class ContinuousCost:
    """J + lambda sum_j MMD^2(F_j, F_j^des) of any controls, by the decision's own kernel.

    The nominal control, and with it F^des, stay the decision's: on its candidates these are the costs it compared.
    """

    controller: Rkhs
    problem: Problem
    desired: Array  # (B, degree) moments of F^des of every disc and wall in reach
    sizes: NDArray[np.int64]  # (B,) of F^des; where 0, max(0, f) is matched with 0

    @classmethod
    def of(cls, controller: Rkhs, observation: Observation) -> "ContinuousCost":
        """Around the decision that the controller takes on the observation. Raises InvalidValue where lanes count."""
        if observation.lanes is not None:
            raise InvalidValue("observation.lanes", observation.lanes, "None: the lanes' terms are not continued")
        problem = controller.problem(observation)
        return cls(controller, problem, *controller.desired(problem).raw_moments(controller.parameters.degree))

    def __call__(self, v: Array, omega: Array) -> Array:
        """The total cost of controls (K,)."""
        p, c = self.problem, self.controller
        parameters = c.parameters
        goal = GoalCost.of(
            Candidates(v, omega), float(p.mean_pose[2]), p.observation.twist, c.limits, c.period, parameters
        )
        moments = p.cone.raw_moments(v, omega, parameters.degree, self.sizes == 0)
        distance = moment_distance(moments, self.desired, parameters.kernel)
        return goal(p.mean_pose[:2], p.observation.goal) + parameters.weight * distance.sum(axis=1)


def variant_costs(scenario: Scenario, observation: Observation) -> list[ContinuousCost]:
    """The cost of every variant, then of the tuned method UNCLIPPED."""
    found = []
    for method, parameters in (*VARIANTS.values(), ("rkhs", UNCLIPPED)):
        controller = variant(scenario, method, **parameters)
        assert isinstance(controller, Rkhs)
        found.append(ContinuousCost.of(controller, observation))
    return found
