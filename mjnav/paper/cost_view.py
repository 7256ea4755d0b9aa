"""One decision's cost, looked at closely: as a surface, along a cut with its slope, and what a call of it takes."""

from dataclasses import dataclass
from time import perf_counter

import numpy as np

from mjnav.control.decision_surface import DecisionSurface, decision_surface
from mjnav.messages import Array, TickRecord
from mjnav.paper.continuous_cost import ContinuousCost, variant_costs
from mjnav.paper.kinks import along_omega, clip_places, slope_jump, slopes
from mjnav.paper.search import by_gradient, starts, window_of
from mjnav.scenarios.spec import Scenario

CUT_STEP = 1e-3  # [rad/s]
STEPS = tuple((10.0 ** np.linspace(-1.5, -4.0, 11)).tolist())  # [rad/s] of the slopes whose jumps are looked at
BATCHES = (1, 5, 402)  # controls a call
CALLS = 50  # of which the median counts


@dataclass(frozen=True, slots=True)
class View:
    """One cost around one decision, over the whole range between the limits; cuts are at the decision's v."""

    surface: DecisionSurface
    ends: Array  # (16, 2) v, omega where the gradient method ended
    cut_omega: Array  # (n,)
    cut_cost: Array  # (n,)
    slope_omega: Array  # (n - 1,) in the middles of the cut's steps
    slope: Array  # (n - 1,)
    clips: Array  # (m,) omega at which a pair of samples meets the clip
    jumps: Array  # (len(STEPS),) largest change of slope from one step to the next, of the range of slopes
    call_seconds: Array  # (3,) median of calls with BATCHES controls


def look(scenario: Scenario, record: TickRecord, num: int) -> tuple[View, ...]:
    """A view of every variant of the scenario's cost, then of the one that is not clipped; surfaces are num x num."""
    return tuple(_view(cost, record.decision.v, num) for cost in variant_costs(scenario, record.observation))


def _view(cost: ContinuousCost, v: float, num: int) -> View:
    controller, observation = cost.controller, cost.problem.observation
    low, high = window_of(cost, "bounds")
    omega, slope = slopes(cost, v, low[1], high[1], CUT_STEP)
    cut = np.linspace(low[1], high[1], omega.size + 1)
    return View(
        surface=decision_surface(controller, observation, controller.decide(observation), num=num),
        ends=np.array([by_gradient(cost, low, high, start).control for start in starts(16)]),
        cut_omega=cut,
        cut_cost=along_omega(cost, v, cut),
        slope_omega=omega,
        slope=slope,
        clips=clip_places(cost, v, cut),
        jumps=np.array([slope_jump(cost, v, low[1], high[1], step) for step in STEPS]),
        call_seconds=np.array([_seconds(cost, low, high, batch) for batch in BATCHES]),
    )


def _seconds(cost: ContinuousCost, low: Array, high: Array, num: int) -> float:
    v, omega = (np.ascontiguousarray(c) for c in np.linspace(low, high, num).T)
    taken = []
    for _ in range(CALLS):
        began = perf_counter()
        cost(v, omega)
        taken.append(perf_counter() - began)
    return float(np.median(taken))
