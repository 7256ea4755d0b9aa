"""What a controller is, and how the candidate is chosen that a decision is.

With J the goal cost (`problem/goal_cost.py`) and a method's risk of every disc and wall j and of both lanes i,

    WeightedController      u* = argmin_u  J(u) + lambda sum_j risk_j(u) + sum_i lambda_i risk_i(u)
    ConstrainedController   u* = argmin_u  J(u)   subject to   risk_j(u) <= bound,  risk_i(u) <= bound
                       or   u* = argmin_u  J(u) + penalty (sum_j [risk_j(u) - bound]_+ + sum_i [risk_i(u) - bound]_+)
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from inspect import isclass
from math import inf
from typing import Any, ClassVar, Generic, Protocol, TypeVar, get_args

import numpy as np

from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.parameters import LoopParameters, MatchingParameters, Parameters, WeightedParameters, completed
from mjnav.control.problem.candidates import cheapest, least_violating
from mjnav.control.problem.desired import Desired
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array, CandidateCosts, Decision, Observation, RobotLimits, Status

P = TypeVar("P", bound=LoopParameters)
M = TypeVar("M", bound=MatchingParameters)


class Controller(Protocol):
    """Turns an observation into a decision.

    A user's own class is called as Class(robot_limits, period, parameters); it has `decide`, and, where it wants them,
    the other members and a `parameters_type` (a frozen dataclass below `LoopParameters`). Its decisions depend on the
    observations since it was made alone: no clock, no random numbers but from its own seeded generator. In the loop it
    does not raise: a failure is a status. `docs/how-to/plugins.md` says how it is named.
    """

    parameters: LoopParameters

    def decide(self, observation: Observation) -> Decision:
        """The control for the moment at which the observation's samples stand."""
        ...

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """Index of the closest obstacle, f's samples at the chosen control, and the desired ones.

        None where no obstacle is in range or the method has no samples of f; for the log only.
        """
        ...


class ProblemController(ABC, Generic[P]):
    """A method that sees an observation as a `Problem`: a subclass gives `decide`.

    A subclass says its parameters once, as in `class Own(WeightedController[OwnParameters])`; that sets its
    `parameters_type`, unless its body does.

    The problem's parameters are the method's own, with defaults for those that it does not have: the cone of a method
    that decides without one is logged by the same measure.
    """

    parameters_type: ClassVar[type[LoopParameters]] = Parameters
    plans_in_time: ClassVar[bool] = False  # takes people where they are predicted at every step; by default `walls`

    def __init_subclass__(cls, **options: Any):
        super().__init_subclass__(**options)
        for kind in (kind for base in vars(cls).get("__orig_bases__", ()) for kind in get_args(base)):
            if isclass(kind) and issubclass(kind, LoopParameters) and "parameters_type" not in vars(cls):
                cls.parameters_type = kind

    def __init__(self, limits: RobotLimits, period: float, parameters: P):
        self.limits, self.period, self.parameters = limits, period, parameters
        self.problem_parameters = completed(parameters)
        self._latest: Problem | None = None

    def problem(self, observation: Observation) -> Problem:
        """The observation as this controller sees it; asked for the same one again, the same problem."""
        if self._latest is None or self._latest.observation is not observation:
            self._latest = Problem(observation, self.limits, self.period, self.problem_parameters)
        return self._latest

    @abstractmethod
    def decide(self, observation: Observation) -> Decision:
        """The control for the moment at which the observation's samples stand."""

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """The closest obstacle's samples at the chosen control, and the method's desired samples."""
        problem = self.problem(observation)
        if not problem.near_discs:
            return None
        samples = problem.nearest_cone.samples(0, np.array([decision.v]), np.array([decision.omega]))[:, 0]
        return problem.near_discs[0], samples, self.desired_cone(problem, 0)

    def desired_cone(self, problem: Problem, block: int) -> Array:
        """The desired samples of one disc or wall; empty for a method without."""
        return np.zeros(0)


class GridController(ProblemController[P]):
    """A method that picks one of the candidates: a subclass gives `evaluate`."""

    def decide(self, observation: Observation) -> Decision:
        """The candidate of least total cost."""
        problem = self.problem(observation)
        costs = self.evaluate(problem)
        best = int(cheapest(costs.total))
        return Decision(float(costs.v[best]), float(costs.omega[best]), self.status(problem, costs, best), costs)

    def status(self, problem: Problem, costs: CandidateCosts, best: int) -> Status:
        """How the decision for candidate `best` came about."""
        infeasible = Status.INFEASIBLE_NOMINAL if problem.violation[costs.nominal] > 0.0 else None
        return status_of(problem.observation, costs.v[best], costs.omega[best], infeasible)

    @abstractmethod
    def evaluate(self, problem: Problem) -> CandidateCosts:
        """The cost of every candidate, term by term."""


class WeightedController(GridController[P]):
    """A method that adds its weighted risk to the goal cost: a subclass gives `risk`.

    Its parameters have a `weight` and `lane_weights`, as `WeightedParameters` do.
    """

    parameters_type: ClassVar[type[LoopParameters]] = WeightedParameters

    @property
    def weights(self) -> tuple[float, Array]:
        """lambda of each disc and wall, and (lambda_1, lambda_2) of the left and the right lane boundary."""
        p: Any = self.parameters
        return p.weight, np.array(p.lane_weights)

    @abstractmethod
    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """The risk of every disc and wall in reach, (K, B), and of the lanes, (K, 2)."""

    def evaluate(self, problem: Problem) -> CandidateCosts:
        """J + lambda sum_j risk_j + sum_i lambda_i risk_i."""
        weight, lane_weights = self.weights
        cone, lane = self.risk(problem)
        total = problem.goal_cost + weight * cone.sum(axis=1) + lane @ lane_weights
        return candidate_costs(problem, cone, lane, total)


class MatchingController(WeightedController[M]):
    """A weighted method whose risk is a distance from the desired distributions: a subclass gives `risk`."""

    _desired: Desired | None = None

    def desired(self, problem: Problem) -> Desired:
        """The desired sets of a problem; asked for the same one again, the same sets."""
        if self._desired is None or self._desired.problem is not problem:
            self._desired = Desired(problem, self.parameters.desired_min, self.parameters.ball)
        return self._desired

    def desired_cone(self, problem: Problem, block: int) -> Array:
        """F^des of one disc or wall."""
        return self.desired(problem).samples(block)


class ConstrainedController(GridController[P]):
    """A method that forbids what is too risky: a subclass gives `risk`, allowed up to `bound`.

    The candidate of least goal cost among those whose every risk is within the bound. Where there is none, status
    `infeasible`: of those with the smallest violation, summed over the constraints, the one of least goal cost.

    Where its parameters have a finite `penalty`, nothing is forbidden: the violation is a cost.
    """

    @property
    def bound(self) -> float:
        """The risk that is allowed of each constraint."""
        return 0.0

    @property
    def penalty(self) -> float:
        """Of the violation; infinite where it is forbidden."""
        return getattr(self.parameters, "penalty", inf)

    @abstractmethod
    def risk(self, problem: Problem) -> tuple[Array, Array]:
        """The risk of every disc and wall in reach, (K, B), and of the lanes, (K, 2)."""

    def evaluate(self, problem: Problem) -> CandidateCosts:
        """Goal cost of the feasible candidates, or, if none is, of those with the smallest violation; else infinite.

        With a finite penalty J + penalty times the violation of all.
        """
        cone, lane = self.risk(problem)
        excess = self._excess(cone, lane)
        if self.penalty < inf:
            return candidate_costs(problem, cone, lane, problem.goal_cost + self.penalty * excess)
        return candidate_costs(problem, cone, lane, np.where(least_violating(excess), problem.goal_cost, inf))

    def status(self, problem: Problem, costs: CandidateCosts, best: int) -> Status:
        """`infeasible` where the chosen candidate exceeds the bound although that is forbidden."""
        if self.penalty == inf and self._excess(costs.cone[[best]], costs.lane[[best]]) > 0.0:
            return Status.INFEASIBLE
        return super().status(problem, costs, best)

    def _excess(self, cone: Array, lane: Array) -> Array:
        """By how much each candidate exceeds the bound, (K,)."""
        return np.maximum(cone - self.bound, 0.0).sum(axis=1) + np.maximum(lane - self.bound, 0.0).sum(axis=1)


def status_of(observation: Observation, v: float, omega: float, infeasible: Status | None = None) -> Status:
    """`infeasible` where it is given, else `stopped` for a robot that stands and is to stay, else `ok`."""
    if infeasible is not None:
        return infeasible
    return Status.STOPPED if v == 0.0 and omega == 0.0 and not observation.twist.any() else Status.OK


def candidate_costs(problem: Problem, cone: Array, lane: Array, total: Array) -> CandidateCosts:
    """The message from the risk of the blocks in reach, (K, B), and of the lanes, (K, 2).

    The blocks go to the columns of all obstacles and walls, (K, J); 0 elsewhere.
    """
    o, c = problem.observation, problem.candidates
    columns = np.zeros((len(cone), len(o.obstacles) + len(o.walls)))
    columns[:, problem.cone.blocks.column] = cone
    return CandidateCosts(c.v, c.omega, problem.goal_cost, columns, lane, total, problem.nominal)


def sample_risk(problem: Problem, reduction: Callable[[Array], Array], *, hinge: bool = False) -> tuple[Array, Array]:
    """The risk of blocks, (K, B), and lanes, (K, 2), where `reduction` takes samples (n, K) to risks (K,).

    With `hinge` it takes those of max(0, f), which are fewer to evaluate.
    """
    return stored_risk(problem, lambda samples: reduction(samples.whole()), hinge=hinge)


def stored_risk(problem: Problem, reduction: Callable[[Samples], Array], *, hinge: bool = False) -> tuple[Array, Array]:
    """The same for a `reduction` that leaves out what is at the floor at all controls: in a crowd that is most."""
    c = problem.candidates
    cone = problem.cone.reduce(c.v, c.omega, reduction, hinge=hinge)
    lane = np.zeros((len(c.v), 2))
    for side, samples in enumerate(problem.lanes):
        lane[:, side] = reduction(Samples.of(np.maximum(samples.T, 0.0) if hinge else samples.T))
    return cone, lane
