"""`mppi`: model predictive path integral control on collision probabilities estimated from samples.

Each rollout is a sequence of T controls, held for `step` seconds each. Rollout k costs

    S_k = 1/T sum_t J(x_t, u_t)  +  weight sum_j sum_t P_jt dt  +  sum_i lambda_i sum_t P_it dt

with J the shared goal cost at the end of every step, P_jt the share of all pairs of samples of the robot and of
obstacle j that collide then, and P_it the share that is beyond lane boundary i: the sums are expected times in
collision. Most rollouts perturb the plan; the plan itself, braking and the straight way to the goal join them. The new
plan is the mean of their controls,

    u = sum_k w_k u_k,   w_k = exp(-(S_k - min S) / temperature) / sum,

and its first control is the decision. All are first brought within the limits, and the limits are convex: the mean
keeps them. (Williams et al. 2017, "Information Theoretic MPC for Model-Based Reinforcement Learning", without its
importance weights: a change of control has a cost of its own. Collision probabilities from samples: DRA-MPPI 2025,
arXiv 2506.21205. Rollouts of other controllers among the perturbed: Trevisan & Alonso-Mora 2024, "Biased-MPPI".)

A plan is feasible where at no step the probability of a collision, or of being beyond a boundary, exceeds `risk_bound`.
A mean of plans that pass an obstacle on different sides may not be: then the cheapest feasible rollout is followed.
Infeasible: no rollout is feasible. Then the cheapest of all is followed, braking being one of them.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from mjnav.control.base import ProblemController, status_of
from mjnav.control.kernels.guides import approach
from mjnav.control.parameters import MOST, Count, GoalParameters, LaneWeights, Positive, Seconds, Share, Weight
from mjnav.control.problem.candidates import cheapest
from mjnav.control.problem.fan import NO_VIOLATION, shown_plan
from mjnav.control.problem.goal_cost import mean_goal_cost
from mjnav.control.problem.mppi_risk import Risk, Surroundings
from mjnav.control.problem.obstacles import Reach, walls_in_reach
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.messages import Array, CandidateCosts, Decision, Observation, RobotLimits, Status
from mjnav.rng import stream
from mjnav.settings import Range

STAND, KEPT = 0, 1  # the first rollouts
SEED = 0  # of the perturbations


@dataclass(frozen=True, slots=True, kw_only=True)
class MppiParameters(GoalParameters):
    """The rollouts and how they are weighed."""

    rollouts: Annotated[Count, "number of perturbed plans, in pairs of opposite perturbations"] = 400
    steps: Annotated[Count, "T, number of steps of a plan"] = 20
    step: Annotated[Seconds, "dt, of each step of a plan"] = 0.2
    temperature: Annotated[Positive, "of the weights exp(-cost / temperature)"] = 0.06
    weight: Annotated[Weight, "lambda, per second of expected collision with each disc and wall"] = 25.0
    lane_weights: LaneWeights = (10.0, 10.0)  # [1/s] of the expected time beyond each
    speed_noise: Annotated[float, Range(0.0, MOST, "m/s"), "standard deviation of the perturbations of v"] = 0.4
    turn_noise: Annotated[float, Range(0.0, MOST, "rad/s"), "standard deviation of the perturbations of omega"] = 0.8
    knots: Annotated[Count, "number of points between which a perturbation is linear"] = 5
    risk_bound: Annotated[
        Share, "share of colliding samples above which a plan is infeasible, at each step and constraint"
    ] = 0.5


@dataclass(frozen=True, slots=True)
class RolloutCosts:
    """K rollouts and what they cost."""

    rollouts: Rollouts
    goal: Array  # (K,)
    risk: Risk
    total: Array  # (K,)

    def only(self, k: int) -> "RolloutCosts":
        """Rollout k alone."""
        risk = Risk(self.risk.cone[[k]], self.risk.lane[[k]], self.risk.worst[[k]])
        return RolloutCosts(self.rollouts.only([k]), self.goal[[k]], risk, self.total[[k]])

    def candidates(self, new: "RolloutCosts") -> CandidateCosts:
        """The message: these rollouts, of which the plan so far is nominal, and then the new plan."""
        v, omega = np.concatenate([self.rollouts.controls[:, 0], new.rollouts.controls[:, 0]], axis=1)
        return CandidateCosts(
            v=v,
            omega=omega,
            goal=np.concatenate([self.goal, new.goal]),
            cone=np.concatenate([self.risk.cone, new.risk.cone]),
            lane=np.concatenate([self.risk.lane, new.risk.lane]),
            total=np.concatenate([self.total, new.total]),
            nominal=KEPT,
        )


class Mppi(ProblemController[MppiParameters]):
    """Plans ahead, and keeps its plan from one decision to the next.

    The plan is moved on by the time between the two observations. It is dropped, for the straight way to the goal,
    where that time is not above 0 or longer than half of the plan. Nothing else is kept: the perturbations are drawn
    once, and the same observations in the same order give the same decisions.
    """

    plans_in_time = True

    def __init__(self, limits: RobotLimits, period: float, parameters: MppiParameters):
        super().__init__(limits, period, parameters)
        p = parameters
        self._perturbations = perturbations(p.rollouts, p.steps, p.knots, (p.speed_noise, p.turn_noise))
        self._plan: Plan | None = None
        # Every wall that a rollout may come to counts.
        self._sight = replace(self.problem_parameters, wall_horizon=parameters.steps * parameters.step)

    def decide(self, observation: Observation) -> Decision:
        """The first control of the new plan.

        The costs are those of the rollouts, each under its first control: braking, the plan so far, which is nominal,
        the way to the goal, the perturbed plans, and last the new plan. `cone` and `lane` are expected times [s].
        """
        p, problem = self.parameters, self.problem(observation)
        reach = Reach(problem.near_discs, walls_in_reach(observation, self.limits, self._sight))
        surroundings = Surroundings.of(problem, reach, p.steps, p.step)
        limits = ControlLimits.of(observation.twist, self.limits, self.period, p.step)
        rows = self.costs(problem, surroundings, limits, self._wanted(problem, limits))
        mean = rows.rollouts.controls @ softmin(rows.total, p.temperature)[:, None]
        new = self.costs(problem, surroundings, limits, mean)
        feasible = rows.risk.worst <= p.risk_bound
        best = int(cheapest(np.where(feasible | ~feasible.any(), rows.total, np.inf)))
        if new.risk.worst[0] > p.risk_bound or best == STAND:  # a mean of rollouts never stops completely
            new = rows.only(best)
        self._plan = Plan(observation.time, new.rollouts.controls[:, :, 0])
        v, omega = self._plan.controls[:, 0].tolist()
        infeasible = Status.INFEASIBLE if new.risk.worst[0] > p.risk_bound else None
        shown = shown_plan(
            rows.rollouts, rows.total, new.rollouts, problem.mean_pose[:2], feasible=infeasible is None,
            violation=NO_VIOLATION,
        )  # fmt: skip
        return Decision(v, omega, status_of(observation, v, omega, infeasible), rows.candidates(new), plan=shown)

    def costs(self, problem: Problem, surroundings: Surroundings, limits: ControlLimits, wanted: Array) -> RolloutCosts:
        """The rollouts of wanted controls (2, T, K), brought within the limits, and their costs."""
        p, o, pose = self.parameters, problem.observation, problem.mean_pose
        rollouts = Rollouts.of(wanted, pose[2], limits, p.step)
        goal_x, goal_y = o.goal - pose[:2]
        goal = mean_goal_cost(rollouts, goal_x - rollouts.x, goal_y - rollouts.y, o.twist, self.limits, self.period, p)
        risk = surroundings.risk(rollouts)
        total = goal + p.weight * risk.cone.sum(axis=1) + risk.lane @ np.array(p.lane_weights)
        return RolloutCosts(rollouts, goal, risk, total)

    def _wanted(self, problem: Problem, limits: ControlLimits) -> Array:
        """The controls that the rollouts start from, (2, T, K)."""
        p, o, pose = self.parameters, problem.observation, problem.mean_pose
        speed = min(p.preferred_speed, self.limits.max_speed)
        straight = approach(o.goal - pose[:2], pose[2], limits, speed, p.step, p.steps, p)
        plan = carried_on(self._plan, o.time, p.step, straight)
        unperturbed = np.stack([np.zeros_like(plan), plan, straight], axis=2)
        return np.concatenate([unperturbed, plan[:, :, None] + self._perturbations], axis=2)


@dataclass(frozen=True, slots=True)
class Plan:
    """Controls for T steps from `time` on."""

    time: float  # [s]
    controls: Array  # (2, T)

    def after(self, passed: float, step: float) -> Array:
        """The controls (2, T) from `passed` [s] later on, between those of two steps; the last is held."""
        at = np.arange(self.controls.shape[1])
        return np.stack([np.interp(at + passed / step, at, u) for u in self.controls])


def carried_on(plan: Plan | None, time: float, step: float, straight: Array) -> Array:
    """The controls (2, T) of a plan moved on to `time` [s].

    Those of the `straight` way where there is no plan, where no time has passed since it was made, or where more has
    than half of its length.
    """
    if plan is None or not 0.0 < time - plan.time <= 0.5 * straight.shape[1] * step:
        return straight
    return plan.after(time - plan.time, step)


def softmin(cost: Array, temperature: float) -> Array:
    """w_k = exp(-(S_k - min S) / temperature) / sum, for costs S (K,)."""
    weights = np.exp((cost.min() - cost) / temperature)
    return weights / weights.sum()


def perturbations(num: int, steps: int, knots: int, noise: tuple[float, float]) -> Array:
    """Perturbations of v and omega, (2, T, num), each followed by its opposite; the same for the same arguments.

    Gaussian at the knots with standard deviations `noise` [m/s, rad/s], linear between them; the knots are spread
    evenly over the steps.
    """
    at = np.linspace(0.0, knots - 1, steps)
    hat = np.maximum(1.0 - np.abs(at[:, None] - np.arange(knots)), 0.0)  # (T, knots)
    drawn = np.stack([
        std * hat @ stream(SEED, channel, "controller").standard_normal((knots, (num + 1) // 2))
        for channel, std in zip(("mppi.v", "mppi.omega"), noise, strict=True)
    ])  # fmt: skip
    return np.stack([drawn, -drawn], axis=-1).reshape(2, steps, -1)[:, :, :num]
