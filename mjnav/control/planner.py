"""What a planner is: it weighs ways to go on, each two moves and then the way to the goal, and makes the first move.

Each rollout k is T controls, held for `step` seconds each (`problem.fan`), and costs

    S_k = w_J / (T v_p^2) sum_t J(x_t, u_t)  +  w_P P_k  +  w_E E_k / v_p^2  +  lambda risk_k

    P_k = (L(x_T) - [L(x_0) - D]_+) / min(D, L(x_0)),  D = v_p T dt  progress: 0 where it drives on at v_p, 1 at rest
    E_k = sum_t ((v_t - v_t-1)^2 + (b / 2)^2 (omega_t - omega_t-1)^2) / dt     effort: the control cost of the metrics

with J the shared goal cost at the end of every step, L(x) the way left to the goal around what stands, v_p the
preferred speed, b the track width. A subclass gives the risk and says which rollouts are feasible. The cheapest
feasible rollout is followed for one period; nothing is kept for the next decision.

Infeasible: no rollout is feasible. Then the cheapest of all is followed.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, TypeVar

import numpy as np

from mjnav.compile.compiled import Matrix, exact
from mjnav.control.base import ProblemController, status_of
from mjnav.control.kernels.guides import ways_left
from mjnav.control.parameters import MOST, Count, GoalParameters, Seconds, Share, Weight, check_memory
from mjnav.control.problem.candidates import cheapest
from mjnav.control.problem.fan import by_first_move, led, moves, num_rollouts, shown_plan
from mjnav.control.problem.goal_cost import mean_goal_cost
from mjnav.control.problem.joint_samples import JointSamples
from mjnav.control.problem.obstacles import Reach, walls_in_reach
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.floor import Floor, floor_of_map
from mjnav.geometry.way_field import WayField, WayGrid
from mjnav.messages import Array, CandidateCosts, Decision, KnownMap, Observation, RobotLimits, Status
from mjnav.settings import Range

Several = Annotated[int, Range(2, int(MOST))]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerParameters(GoalParameters):
    """The rollouts and how they are weighed."""

    num_speeds: Annotated[Several, "number of speeds of the first moves"] = 3
    num_turn_rates: Annotated[Several, "number of turn rates of the first moves"] = 7
    hold: Annotated[Seconds, "how long a first move is held"] = 0.6
    steps: Annotated[Count, "T, number of steps of a plan"] = 20
    step: Annotated[Seconds, "dt, of each step of a plan"] = 0.2
    goal_weight: Annotated[Weight, "w_J, of the mean goal cost"] = 0.305
    progress_weight: Annotated[Weight, "w_P, of the way that is left"] = 1.18
    effort_weight: Annotated[Weight, "w_E, of the control cost"] = 0.2
    risk_bound: Annotated[Share, "share of samples with a contact above which a plan is infeasible"] = 0.5


HERE = np.zeros((1, 1))
P = TypeVar("P", bound=PlannerParameters)


@dataclass(frozen=True, slots=True)
class Risks:
    """The risk of K rollouts."""

    cost: Array  # (K,) weighted, as it joins the other terms
    contact: Array  # (K,) probability of a contact, as the method has it
    violation: Array  # (K, S) h; (K, 0) of a method without


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


class Planner(ProblemController[P]):
    """Plans ahead, each time anew: a subclass gives `risks_of`."""

    parameters_type = PlannerParameters
    plans_in_time = True

    def __init__(self, limits: RobotLimits, period: float, parameters: P):
        super().__init__(limits, period, parameters)
        p = parameters
        check_memory(p, num_rollouts(p.num_speeds, p.num_turn_rates, reverses=limits.min_speed < 0.0))
        self._way: tuple[bytes, WayField] | None = None
        self._speed = min(p.preferred_speed, limits.max_speed)
        self._moves = moves(limits, np.zeros(2), self._speed, p.num_speeds, p.num_turn_rates, p.hold)
        # Every wall that a rollout may come to counts.
        self._sight = replace(self.problem_parameters, wall_horizon=p.steps * p.step)

    @abstractmethod
    def risks_of(self, problem: Problem, reach: Reach, samples: JointSamples) -> Callable[[Rollouts], Risks]:
        """What tells the risk of rollouts in one decision's problem; their steps are those of the joint samples."""

    def decide(self, observation: Observation) -> Decision:
        """The first control of the rollout that is followed."""
        p, o, problem = self.parameters, observation, self.problem(observation)
        reach = Reach(problem.near_discs, walls_in_reach(o, self.limits, self._sight))
        samples = self.joint_samples(problem, reach, p.steps)
        limits = ControlLimits.of(o.twist, self.limits, self.period, p.step)
        way = self._way_to(problem)
        by_first_move(self._moves)[-1, :, :2] = o.twist
        rollouts = led(
            self._moves, problem.mean_pose, way, limits, self._speed, p.approach_time, p.preview, p.step, p.steps
        )
        weighed = self.weigh(problem, way, self.risks_of(problem, reach, samples), rollouts)
        feasible = weighed.risks.contact <= p.risk_bound
        possible = bool(feasible.any())
        k = int(cheapest(np.where(feasible | (not possible), weighed.total, np.inf)))
        v, omega = weighed.rollouts.controls[:, 0, k].tolist()
        status = status_of(o, v, omega, None if possible else Status.INFEASIBLE)
        shown = shown_plan(
            weighed.rollouts, weighed.total, weighed.rollouts.only([k]), problem.mean_pose[:2], feasible=possible,
            violation=weighed.risks.violation[k],
        )  # fmt: skip
        return Decision(v, omega, status, _message(problem, weighed, k), plan=shown)

    def weigh(self, problem: Problem, way: WayGrid, risks: Callable[[Rollouts], Risks], rollouts: Rollouts) -> Weighed:
        """What rollouts cost."""
        p, o, pose = self.parameters, problem.observation, problem.mean_pose
        left, by_x, by_y = _ways_left(way, pose, rollouts.x, rollouts.y)
        at_start, speed = float(_ways_left(way, pose, HERE, HERE)[0][0, 0]), self._speed
        goal = p.progress_weight * progress(left, at_start, speed * p.steps * p.step)
        for by in (by_x, by_y):  # becomes the way; never -0.0, whose bearing is pi, at a goal that is reached
            np.subtract(0.0, np.multiply(left, by, out=by), out=by)
        along = mean_goal_cost(rollouts, by_x, by_y, o.twist, self.limits, self.period, p)
        changes = effort(rollouts, o.twist, 0.5 * self.limits.track_width)
        goal += (p.goal_weight * along + p.effort_weight * changes) / speed**2
        return Weighed(rollouts, goal, risks(rollouts))

    def _way_to(self, problem: Problem) -> WayGrid:
        """The way left to the goal; computed anew where the goal or the map is another. A planned way is taken."""
        known, goal, planned = problem.observation.map, problem.observation.goal, problem.observation.way
        if planned is not None:
            key = planned.number.to_bytes(8)
            if self._way is None or self._way[0] != key:
                detour, (x, y), (gx, gy) = np.array(planned.detour), planned.corner.tolist(), planned.point.tolist()
                self._way = key, WayField(WayGrid(detour, x, y, planned.cell, gx, gy))
            return self._way[1].grid
        key = goal.tobytes() + (b"" if known is None else known.walls.tobytes() + known.discs.tobytes())
        if self._way is None or self._way[0] != key:
            self._way = key, self.way_field(known, goal, problem.mean_pose[:2])
        return self._way[1].grid

    def joint_samples(self, problem: Problem, reach: Reach, steps: int) -> JointSamples:
        """The joint samples of what is in reach, for `steps` steps."""
        return JointSamples.of(problem, reach, steps, self.parameters.step)

    def way_field(self, known: KnownMap | None, goal: Array, start: Array) -> WayField:
        """The way left to `goal` (2,) from about `start` (2,) past what the map knows; straight without a map."""
        floor = Floor(np.zeros((0, 3)), np.zeros((0, 6))) if known is None else floor_of_map(known)
        return WayField.of(floor, goal, self.limits.half_width + self.parameters.safety_margin, start[None])


def _ways_left(way: WayGrid, pose: Array, x: Array, y: Array) -> tuple[Array, Array, Array]:
    """The way left [m] and its derivatives by x and y, each (T, K), at positions x, y (T, K) from a pose (3,)."""
    left, by_x, by_y = np.empty(x.shape), np.empty(x.shape), np.empty(x.shape)
    ways_left(left, by_x, by_y, x, y, pose[:2], way)
    return left, by_x, by_y


def progress(left: Array, at_start: float, way: float) -> Array:
    """P of plans with `left` (T, K) [m] to go, where there were `at_start` [m]; in T steps `way` [m] can be driven.

    At the goal, where no share of the way can be told, the way of one step stands for what is left.
    """
    return (left[-1] - max(at_start - way, 0.0)) / min(way, max(at_start, way / len(left)))


def effort(rollouts: Rollouts, twist: Array, half_track: float) -> Array:
    """E of rollouts whose first control follows `twist` (2,), (K,); `half_track` is b / 2 [m]."""
    v, omega = (_changes(u, float(before)) for u, before in zip(rollouts.controls, twist, strict=True))
    return (v + half_track**2 * omega) / rollouts.step


@exact
def _changes(u: Matrix, before: float):
    """The sums of the squared changes of controls (T, K), the first from `before`."""
    total = np.zeros(u.shape[1])
    for t in range(u.shape[0]):
        for k in range(u.shape[1]):
            change = u[t, k] - (u[t - 1, k] if t > 0 else before)
            total[k] += change * change
    return total


def _message(problem: Problem, weighed: Weighed, followed: int) -> CandidateCosts:
    """The rollouts, each under its first control; the way to the goal is nominal, the one that is followed is last.

    The risk is one of all obstacles together: it stands in the column of the nearest.
    """
    rows = np.arange(len(weighed.goal) + 1)
    rows[-1] = followed
    v, omega = weighed.rollouts.controls[:, 0, rows]
    o = problem.observation
    cone = np.zeros((len(rows), len(o.obstacles) + len(o.walls)))
    if cone.shape[1]:
        cone[:, problem.near_discs[0] if problem.near_discs else 0] = weighed.risks.cost[rows]
    nominal = len(weighed.goal) - 1
    return CandidateCosts(v, omega, weighed.goal[rows], cone, np.zeros((len(rows), 2)), weighed.total[rows], nominal)
