"""What a planner is: it weighs sequences of controls, and keeps its plan from one decision to the next.

Each rollout is T controls, held for `step` seconds each, and then the hardest braking to rest: every plan ends where
the robot stands. Rollout k costs

    S_k = w_J / (T v_p^2) sum_t J(x_t, u_t)  +  w_P P_k  +  w_E E_k / v_p^2  +  lambda risk_k

    P_k = (L(x_T) - [L(x_0) - D]_+) / min(D, L(x_0)),  D = v_p T dt  progress: 0 where it drives on at v_p, 1 at rest
    E_k = sum_t ((v_t - v_t-1)^2 + (b / 2)^2 (omega_t - omega_t-1)^2) / dt     effort: the control cost of the metrics

with J the shared goal cost at the end of every step, L(x) the way left to the goal around what stands, v_p the
preferred speed, b the track width. A subclass gives the risk and says which rollouts are feasible. The new plan is the
softmin mean of the rollouts' controls,

    u = sum_k w_k u_k,   w_k = exp(-(S_k - min S) / temperature) / sum,

or the cheapest feasible rollout where that costs less or the mean is not feasible; its first control is the decision.
(Williams et al. 2017, "Information Theoretic MPC for Model-Based Reinforcement Learning", without its importance
weights: a change of control has a cost of its own.)

Infeasible: no rollout is feasible. Then the one is followed under which the first contact comes latest, on average over
the joint samples: it leaves everybody the most time.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import ceil
from typing import Annotated, TypeVar

import numpy as np

from mjnav.control.base import ProblemController, status_of
from mjnav.control.kernels.guides import ways_left
from mjnav.control.parameters import MOST, Count, GoalParameters, Positive, Seconds, Share, Weight, check_memory
from mjnav.control.problem.candidates import cheapest
from mjnav.control.problem.fan import KEPT, Plan, carried_on, guided, guides, perturbations, shown_plan, softmin
from mjnav.control.problem.goal_cost import mean_goal_cost
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach, walls_in_reach
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.floor import Floor, floor_of_map
from mjnav.geometry.way_field import WayField, WayGrid
from mjnav.messages import Array, CandidateCosts, Decision, KnownMap, Observation, RobotLimits, Status
from mjnav.settings import Range


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters(GoalParameters):
    """The rollouts and how they are weighed."""

    rollouts: Annotated[Count, "number of perturbed plans, in pairs of opposite perturbations"] = 320
    steps: Annotated[Count, "T, number of steps of a plan"] = 20
    step: Annotated[Seconds, "dt, of each step of a plan"] = 0.2
    temperature: Annotated[Positive, "of the weights exp(-cost / temperature)"] = 0.0642
    goal_weight: Annotated[Weight, "w_J, of the mean goal cost"] = 0.305
    progress_weight: Annotated[Weight, "w_P, of the way that is left"] = 1.18
    effort_weight: Annotated[Weight, "w_E, of the control cost"] = 0.14
    half_track: Annotated[float, Range(0.0, MOST, "m"), "b / 2, half of the track width, in the control cost"] = 0.17
    speed_noise: Annotated[float, Range(0.0, MOST, "m/s"), "standard deviation of the perturbations of v"] = 0.4
    turn_noise: Annotated[float, Range(0.0, MOST, "rad/s"), "standard deviation of the perturbations of omega"] = 0.8
    knots: Annotated[Count, "number of points between which a perturbation is linear"] = 5
    quiet: Annotated[Share, "scale of every other pair of perturbations"] = 0.35
    risk_bound: Annotated[Share, "share of samples with a contact above which a plan is infeasible"] = 0.5


HERE = np.zeros((1, 1))
ROUNDING = 1e-9  # [steps]
P = TypeVar("P", bound=PlannerParameters)


@dataclass(frozen=True, slots=True)
class Risks:
    """The risk of K rollouts."""

    cost: Array  # (K,) weighted, as it joins the other terms
    contact: Array  # (K,) probability of a contact, as the method has it
    violation: Array  # (K, S) h; (K, 0) of a method without

    def only(self, k: int) -> "Risks":
        """Rollout k alone."""
        return Risks(self.cost[[k]], self.contact[[k]], self.violation[[k]])


@dataclass(frozen=True, slots=True)
class Weighed:
    """K rollouts and what they cost."""

    rollouts: Rollouts
    goal: Array  # (K,) all but the risk
    risks: Risks

    @property
    def total(self) -> Array:
        """S, (K,)."""
        return self.goal + self.risks.cost

    def only(self, k: int) -> "Weighed":
        """Rollout k alone."""
        return Weighed(self.rollouts.only(k), self.goal[[k]], self.risks.only(k))


class Planner(ProblemController[P]):
    """Plans ahead, and keeps its plan from one decision to the next: a subclass gives `risks_of`.

    The plan is moved on by the time between the two observations. It is dropped, for the straight way to the goal,
    where that time is not above 0 or longer than half of the plan. Nothing else is kept: the perturbations are drawn
    once, and the same observations in the same order give the same decisions.
    """

    parameters_type = PlannerParameters
    ends_at_rest = True  # whether rollouts are weighed with the braking after their last step
    follows_mean = True  # whether the mean of the rollouts is one of the plans to choose from

    def __init__(self, limits: RobotLimits, period: float, parameters: P):
        super().__init__(limits, period, parameters)
        p = parameters
        self._tail = braking_steps(limits, p.step) if self.ends_at_rest else 0
        check_memory(p, self._tail)
        self._perturbations = perturbations(p.rollouts, p.steps, p.knots, (p.speed_noise, p.turn_noise), p.quiet)
        self._plan: Plan | None = None
        self._way: tuple[bytes, WayField] | None = None
        # Every wall that a rollout may come to counts.
        self._sight = replace(self.problem_parameters, wall_horizon=(p.steps + self._tail) * p.step)

    @abstractmethod
    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """What tells the risk of rollouts in one decision's problem; their steps are those of the joint samples."""

    def decide(self, observation: Observation) -> Decision:
        """The first control of the new plan."""
        p, problem = self.parameters, self.problem(observation)
        reach = Reach(problem.near_discs, walls_in_reach(observation, self.limits, self._sight))
        samples = self.joint_samples(problem, reach, p.steps + self._tail)
        limits = ControlLimits.of(observation.twist, self.limits, self.period, p.step)
        way = self._way_to(problem)
        weigh = partial(self.weigh, problem, limits, way, self.risks_of(problem, reach, samples))
        rows = weigh(self._wanted(problem, limits, way))
        feasible = rows.risks.contact <= p.risk_bound
        if feasible.any():
            new = rows.only(int(cheapest(np.where(feasible, rows.total, np.inf))))
            if self.follows_mean:
                mean = weigh(rows.rollouts.controls[:, : p.steps] @ softmin(rows.total, p.temperature)[:, None])
                if mean.total[0] <= new.total[0] and mean.risks.contact[0] <= p.risk_bound:
                    new = mean
        else:
            new = rows.only(int(cheapest(samples.lost_time(rows.rollouts))))
        self._plan = Plan(observation.time, new.rollouts.controls[:, : p.steps, 0])
        v, omega = self._plan.controls[:, 0].tolist()
        possible = bool(feasible.any())
        status = status_of(observation, v, omega, None if possible else Status.INFEASIBLE)
        shown = shown_plan(
            rows.rollouts, rows.total, new.rollouts, problem.mean_pose[:2], feasible=possible,
            violation=new.risks.violation[0],
        )  # fmt: skip
        return Decision(v, omega, status, _message(problem, rows, new), plan=shown)

    def weigh(
        self, problem: Problem, limits: ControlLimits, way: WayGrid, risks: Callable[[Rollouts], Risks], wanted: Array
    ) -> Weighed:
        """The rollouts of wanted controls (2, T, K), brought within the limits, and what they cost."""
        p, o, pose = self.parameters, problem.observation, problem.mean_pose
        braking = np.zeros((2, self._tail, wanted.shape[2]))
        rollouts = Rollouts.of(np.concatenate([wanted, braking], axis=1), pose[2], limits, p.step)
        plans = rollouts.first(p.steps)
        left, by_x, by_y = _ways_left(way, pose, plans.x, plans.y)
        speed = min(p.preferred_speed, self.limits.max_speed)
        at_start = float(_ways_left(way, pose, HERE, HERE)[0][0, 0])
        goal = p.progress_weight * progress(left, at_start, speed * p.steps * p.step)
        dx, dy = 0.0 - left * by_x, 0.0 - left * by_y  # never -0.0, whose bearing is pi, at a goal that is reached
        along = mean_goal_cost(plans, dx, dy, o.twist, self.limits, self.period, p)
        goal += (p.goal_weight * along + p.effort_weight * effort(plans, o.twist, p.half_track)) / speed**2
        return Weighed(rollouts, goal, risks(rollouts))

    def _wanted(self, problem: Problem, limits: ControlLimits, way: WayGrid) -> Array:
        """The controls that the rollouts start from, (2, T, K)."""
        p, o, pose = self.parameters, problem.observation, problem.mean_pose
        _, by_x, by_y = _ways_left(way, pose, HERE, HERE)
        speed = min(p.preferred_speed, self.limits.max_speed)
        back = min(speed, max(-self.limits.min_speed, 0.0))
        rows = self.guides(float(pose[2]), float(np.arctan2(-by_y, -by_x)[0, 0]), speed, back)
        ways = guided(rows, pose, way, limits, p.approach_time, p.preview, p.step, p.steps)
        plan = carried_on(self._plan, o.time, p.step, ways[:, :, 0])
        unperturbed = np.stack([np.zeros_like(plan), plan], axis=2)
        return np.concatenate([unperturbed, ways, plan[:, :, None] + self._perturbations], axis=2)

    def _way_to(self, problem: Problem) -> WayGrid:
        """The way left to the goal; computed anew where the goal or the map is another."""
        known, goal = problem.observation.map, problem.observation.goal
        key = goal.tobytes() + (b"" if known is None else known.walls.tobytes() + known.discs.tobytes())
        if self._way is None or self._way[0] != key:
            self._way = key, self.way_field(known, goal, problem.mean_pose[:2])
        return self._way[1].grid

    def joint_samples(self, problem: Problem, reach: Reach, steps: int) -> JointSamples:
        """The joint samples of what is in reach, for `steps` steps."""
        return JointSamples.of(problem, reach, steps, self.parameters.step)

    def guides(self, heading: float, way_direction: float, speed: float, back_speed: float) -> Array:
        """The simple ways (G, 4) among the rollouts, `problem.fan.guides`; the first is straight to the goal."""
        return guides(heading, way_direction, speed, back_speed)

    def way_field(self, known: KnownMap | None, goal: Array, start: Array) -> WayField:
        """The way left to `goal` (2,) from about `start` (2,) past what the map knows; straight without a map."""
        floor = Floor(np.zeros((0, 3)), np.zeros((0, 6))) if known is None else floor_of_map(known)
        return WayField.of(floor, goal, self.limits.radius + self.parameters.safety_margin, start[None])


def _ways_left(way: WayGrid, pose: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """The way left [m] and its derivatives by x and y, each (T, K), at positions x, y (T, K) from a pose (3,)."""
    left, by_x, by_y = np.empty(x.shape), np.empty(x.shape), np.empty(x.shape)
    ways_left(left, by_x, by_y, x, y, pose[:2], way)
    return left, by_x, by_y


def braking_steps(limits: RobotLimits, step: float) -> int:
    """How many steps of `step` [s] bring the robot to rest from any speed and turn rate."""
    from_speed = max(limits.max_speed, -limits.min_speed) / limits.max_acceleration
    return ceil(max(from_speed, limits.max_turn_rate / limits.max_turn_acceleration) / step - ROUNDING)


def progress(left: Array, at_start: float, way: float) -> Array:
    """P of plans with `left` (T, K) [m] to go, where there were `at_start` [m]; in T steps `way` [m] can be driven.

    At the goal, where no share of the way can be told, the way of one step stands for what is left.
    """
    return (left[-1] - max(at_start - way, 0.0)) / min(way, max(at_start, way / len(left)))


def effort(rollouts: Rollouts, twist: Array, half_track: float) -> Array:
    """E of rollouts whose first control follows `twist` (2,), (K,)."""
    dv, domega = (
        np.diff(np.concatenate([np.full((1, u.shape[1]), before), u]), axis=0)
        for u, before in zip(rollouts.controls, twist, strict=True)
    )
    return ((dv**2).sum(axis=0) + half_track**2 * (domega**2).sum(axis=0)) / rollouts.step


def _message(problem: Problem, rows: Weighed, new: Weighed) -> CandidateCosts:
    """The rollouts, each under its first control; the plan so far is nominal, the new plan is last.

    The risk is one of all obstacles together: it stands in the column of the nearest.
    """
    v, omega = np.concatenate([rows.rollouts.controls[:, 0], new.rollouts.controls[:, 0]], axis=1)
    o, num = problem.observation, len(rows.goal) + 1
    cone = np.zeros((num, len(o.obstacles) + len(o.walls)))
    if cone.shape[1]:
        cone[:, problem.near_discs[0] if problem.near_discs else 0] = np.append(rows.risks.cost, new.risks.cost)
    goal, total = np.append(rows.goal, new.goal), np.append(rows.total, new.total)
    return CandidateCosts(v, omega, goal, cone, np.zeros((num, 2)), total, KEPT)
