"""What a log shows of a method that plans ahead: the plan, and some of the rollouts that it weighed."""

import numpy as np

from mjnav.control.kernels.mppi_rollout import Rollouts
from mjnav.messages import Array, PlanShown

FAN = 32  # rollouts shown, at most
NO_VIOLATION = np.zeros(0)  # of a method that has none


def shown_plan(
    rollouts: Rollouts, cost: Array, followed: Rollouts, position: Array, *, feasible: bool, violation: Array
) -> PlanShown:
    """The message of a plan, `followed`, the first of its rollouts, from `position` (2,) [m].

    The fan are FAN of the K `rollouts`, evenly over the order of their `cost` (K,), cheapest first; `violation` (S,) is
    the plan's.
    """
    shown = np.argsort(cost, kind="stable")[np.linspace(0, cost.size - 1, min(FAN, cost.size)).astype(int)]
    return PlanShown(
        step=followed.step,
        path=position + np.stack([followed.x[:, 0], followed.y[:, 0]], axis=-1),
        fan=position + np.stack([rollouts.x[:, shown].T, rollouts.y[:, shown].T], axis=-1),
        fan_cost=cost[shown],
        violation=violation,
        feasible=feasible,
    )
