"""The cost of a decision as a surface over (v, omega).

    goal J(v, omega)  +  weighted cone and wall terms  +  weighted lane terms  =  total

The controls of a fine grid are appended to the decision's own candidates, and the method itself computes the costs of
all. The nominal controls, and with them the desired distributions, stay those of the decision. So the surface passes
through the costs that were compared, and continues them beyond the candidates.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mjnav.control.base import Controller, GridController, WeightedController
from mjnav.control.parameters import WINDOWS, at_least
from mjnav.control.problem.candidates import Candidates, candidate_grid
from mjnav.control.problem.problem import Problem
from mjnav.control.registry import METHODS
from mjnav.errors import InvalidValue, unknown_name
from mjnav.messages import Array, CandidateCosts, Decision, Observation
from mjnav.motion.unicycle import reachable


@dataclass(frozen=True, slots=True)
class DecisionSurface:
    """The costs of V x W controls, term by term, around one decision.

    Where `weighted`, the terms carry the method's weights and add up to `total`. For a method that forbids what is too
    risky, `cone` and `lane` are the risks, and `total` is infinite where it forbids: that may be the whole grid, where
    nothing is allowed and the chosen control does not lie on the grid.
    """

    v: Array  # (V,) [m/s]
    omega: Array  # (W,) [rad/s]
    goal: Array  # (V, W)
    cone: Array  # (V, W, J) each obstacle, then each wall; zero where that is out of reach
    lane: Array  # (V, W, 2) left, right
    total: Array  # (V, W)
    weighted: bool
    decision: Decision
    costs: CandidateCosts  # of the decision's own candidates
    reachable: Array  # (2, 2) lowest and highest (v, omega) that one period allows

    @property
    def cone_term(self) -> Array:
        """What obstacles and walls add to the total, (V, W); where not `weighted`, the greatest of their risks."""
        return self._term(self.cone)

    @property
    def lane_term(self) -> Array:
        """The same of the lanes."""
        return self._term(self.lane)

    def _term(self, parts: Array) -> Array:
        if self.weighted:
            return parts.sum(axis=-1)
        parts = parts[:, :, parts.any(axis=(0, 1))]  # without obstacles out of reach
        return parts.max(axis=-1) if parts.size else np.zeros_like(self.total)

    @property
    def nominal(self) -> Array:
        """The nominal control of the decision, (2,)."""
        return np.array([values[self.costs.nominal] for values in (self.costs.v, self.costs.omega)])

    @property
    def minimum(self) -> tuple[int, int] | None:
        """Where `total` is least: indices into `v` and `omega`; None where all of it is infinite."""
        if np.isinf(self.total).all():
            return None
        i, j = np.unravel_index(np.argmin(self.total), self.total.shape)
        return int(i), int(j)


@dataclass(frozen=True)
class _WiderProblem(Problem):
    """A problem with further candidates, none of which can be nominal."""

    beyond: Candidates

    @cached_property
    def candidates(self) -> Candidates:
        own = super().candidates
        return Candidates(np.concatenate([own.v, self.beyond.v]), np.concatenate([own.omega, self.beyond.omega]))

    def cheapest(self, cost: Array, violation: Array) -> list[int]:
        own = cost.shape[-1] - len(self.beyond.v)
        return super().cheapest(cost[:, :own], violation[:, :own])


def decision_surface(
    controller: GridController, observation: Observation, decision: Decision, *, window: str = "bounds", num: int = 61
) -> DecisionSurface:
    """The costs of num x num controls for `controller` and the `observation` on which it took `decision`.

    `window` "bounds" covers the whole range between the limits, "reachable" what one period allows. Raises InvalidValue
    for a window or number that is not allowed.
    """
    if window not in WINDOWS:
        raise unknown_name("window", window, WINDOWS)
    at_least("num", num, 2)
    if decision.costs is None:
        raise InvalidValue("decision.costs", None, "the costs of the candidates")
    limits, period = controller.limits, controller.period
    grid = candidate_grid(observation.twist, limits, period, num, num, window)
    grid = Candidates(grid.v[:-2], grid.omega[:-2])  # without keep and brake
    costs = controller.evaluate(_WiderProblem(observation, limits, period, controller.problem_parameters, grid))

    def on_grid(values: Array) -> Array:
        return values[-num * num :].reshape(num, num, *values.shape[1:])

    weighted = isinstance(controller, WeightedController)
    weight, lane_weights = controller.weights if weighted else (1.0, np.ones(2))
    return DecisionSurface(
        v=grid.v[::num],
        omega=grid.omega[:num],
        goal=on_grid(costs.goal),
        cone=weight * on_grid(costs.cone),
        lane=lane_weights * on_grid(costs.lane),
        total=on_grid(costs.total),
        weighted=weighted,
        decision=decision,
        costs=decision.costs,
        reachable=np.stack(reachable(observation.twist, limits, period)),
    )


def require_candidates(controller: Controller, method: str) -> GridController:
    """The controller itself, if it takes the cheapest candidate; else raises InvalidValue with the methods that do."""
    if isinstance(controller, GridController) and _takes_cheapest(type(controller)):
        return controller
    able = sorted(name for name, entry in METHODS.items() if _takes_cheapest(entry.controller_class))
    raise InvalidValue("control.method", method, f"a method that chooses from candidates: {', '.join(able)}")


def _takes_cheapest(kind: type) -> bool:
    """Whether `decide` is GridController's: another one may choose other controls than the candidates."""
    return getattr(kind, "decide", None) is GridController.decide
