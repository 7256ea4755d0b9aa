"""The cost of one decision as a function of any control (v, omega), and where it has kinks along omega.

Along a cut of constant v, the slope from one step of h to the next changes by h c'' where the cost is smooth, and by
the size of the kink, whatever h, where it has one. The segment form itself has none: where t* reaches 0 or the
horizon, f is stationary in t, so its slope is continuous. max(f, -clip) and max(0, f) have one for every pair of
samples.
"""

from collections.abc import Callable, Mapping
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

Cost = Callable[[Array, Array], Array]  # of controls v, omega (K,): (K,)

# name -> method, and which of its parameters are changed
VARIANTS: Mapping[str, tuple[str, Mapping[str, Any]]] = MappingProxyType(
    {
        "d = 1": ("rkhs", {"degree": 1}),
        "d = 2": ("rkhs", {"degree": 2}),
        "d = 3": ("rkhs", {"degree": 3}),
        "as published": ("rkhs-paper", {}),
    }
)
CHUNK = 400  # controls a call, which the kernel is made for
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


def along_omega(cost: Cost, v: float, omega: Array) -> Array:
    """The cost at one v and many omega (n,)."""
    parts = np.array_split(omega, -(-omega.size // CHUNK))
    return np.concatenate([cost(np.full(part.size, v), part) for part in parts])


def slopes(cost: Cost, v: float, low: float, high: float, step: float) -> tuple[Array, Array]:
    """Slopes [1/(rad/s)] from one step to the next and the omega in their middle, (n,) each."""
    omega = np.linspace(low, high, round((high - low) / step) + 1)
    slope = np.diff(along_omega(cost, v, omega)) / np.diff(omega)
    return 0.5 * (omega[1:] + omega[:-1]), slope


def slope_jump(cost: Cost, v: float, low: float, high: float, step: float) -> float:
    """The largest change of the slope from one step to the next, as a share of the range of slopes; 0 on a plane."""
    _, slope = slopes(cost, v, low, high, step)
    span = np.ptp(slope)
    return float(np.abs(np.diff(slope)).max() / span) if span > 0.0 else 0.0


def clip_places(cost: ContinuousCost, v: float, omega: Array) -> Array:
    """The omega at which a pair of samples meets the clip or leaves it, between those given (n,); sorted."""
    floor = -cost.controller.parameters.clip
    found = []
    for block in range(len(cost.problem.cone.blocks.column)):
        clipped = cost.problem.cone.samples(block, np.full(omega.size, v), omega) <= floor  # (pairs, n)
        _, at = np.nonzero(clipped[:, 1:] != clipped[:, :-1])
        found.append(0.5 * (omega[at] + omega[at + 1]))
    return np.sort(np.concatenate(found)) if found else np.zeros(0)
