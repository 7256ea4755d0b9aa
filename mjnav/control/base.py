"""What a controller is, and what all that choose from the candidate grid share."""

from abc import ABC, abstractmethod
from typing import ClassVar, Protocol

import numpy as np

from mjnav.control.parameters import Parameters
from mjnav.control.problem import Problem
from mjnav.messages import Array, CandidateCosts, Decision, Observation, RobotLimits, Status


class Controller(Protocol):
    """Turns an observation into a decision. It keeps no state that changes what it decides, and it does not raise."""

    parameters: Parameters

    def decide(self, observation: Observation) -> Decision:
        """The control for the moment at which the observation's samples stand."""
        ...

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """Index of the closest obstacle, f's samples at the chosen control, and the desired ones.

        None where no obstacle is in range or the method has no samples of f; for the log only.
        """
        ...


class GridController(ABC):
    """A method that picks one of the candidates: a subclass gives `evaluate` and its parameters' type."""

    parameters_type: ClassVar[type[Parameters]] = Parameters

    def __init__(self, limits: RobotLimits, period: float, parameters: Parameters):
        self.limits, self.period, self.parameters = limits, period, parameters
        self._latest: Problem | None = None

    def problem(self, observation: Observation) -> Problem:
        """The observation as this controller sees it; asked for the same one again, the same problem."""
        if self._latest is None or self._latest.observation is not observation:
            self._latest = Problem(observation, self.limits, self.period, self.parameters)
        return self._latest

    def decide(self, observation: Observation) -> Decision:
        """The candidate of least total cost."""
        problem = self.problem(observation)
        costs = self.evaluate(problem)
        best = int(np.argmin(costs.total))
        return decision_at(problem, costs, best)

    @abstractmethod
    def evaluate(self, problem: Problem) -> CandidateCosts:
        """The cost of every candidate, term by term."""

    def closest_cone(self, observation: Observation, decision: Decision) -> tuple[int, Array, Array] | None:
        """The closest obstacle's samples at the chosen control, and what the method wants of them."""
        problem = self.problem(observation)
        if not problem.reach.discs:
            return None
        samples = problem.cone.samples(0, np.array([decision.v]), np.array([decision.omega]))[:, 0]
        return problem.reach.discs[0], samples, self.desired_cone(problem, 0)

    def desired_cone(self, problem: Problem, block: int) -> Array:
        """The samples that the method wants of one disc or wall; empty for a method that wants none."""
        return np.zeros(0)


def decision_at(problem: Problem, costs: CandidateCosts, best: int) -> Decision:
    """The decision for candidate `best`, with its status."""
    v, omega = float(costs.v[best]), float(costs.omega[best])
    if problem.violation[costs.nominal] > 0.0:
        status = Status.INFEASIBLE_NOMINAL
    elif v == 0.0 and omega == 0.0 and not problem.observation.twist.any():
        status = Status.STOPPED
    else:
        status = Status.OK
    return Decision(v, omega, status, costs)


def spread_columns(problem: Problem, risk: Array) -> Array:
    """The risk of the blocks in reach, (K, B), in the columns of all obstacles and walls, (K, J); 0 elsewhere."""
    o = problem.observation
    columns = np.zeros((len(risk), len(o.obstacles) + len(o.walls)))
    columns[:, problem.cone.blocks.column] = risk
    return columns
