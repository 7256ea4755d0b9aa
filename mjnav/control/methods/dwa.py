"""`dwa`: the dynamic window approach, at the means only.

Of the controls that are reachable within one period (the dynamic window: the candidates) those are admissible after
which the robot can stop before it touches anything. With dist(v, omega) the way along the arc to the first contact with
a disc, wall or lane boundary, and a, a_omega the greatest accelerations,

    v <= sqrt(2 dist a)   and   |omega| <= sqrt(2 (dist |omega / v|) a_omega),

dist |omega / v| being the angle turned until then. Among those,

    u* = argmin_u  J(u) + weight (1 - min(dist(u), clearance) / clearance)

(Fox, Burgard & Thrun 1997, "The Dynamic Window Approach to Collision Avoidance"). The shared goal cost J stands in
place of the published terms of heading and speed, so that only the risk differs from other methods. The velocities of
obstacles are ignored, as published, where `moving` is false, the class's default. Where it is true, as by the name
`dwa`, a disc goes on at its mean velocity (Seder & Petrovic 2007, "Dynamic window based approach to mobile robot motion
control in the presence of moving obstacles").

Infeasible: no candidate is admissible. Then only those remain whose stopping distance, v^2 / 2a or
|v omega| / 2a_omega, exceeds the distance to the contact least.
"""

from dataclasses import dataclass
from math import inf
from typing import Annotated

import numpy as np

from mjnav.constraints.arc import contact_distance, contact_distance_moving
from mjnav.constraints.walls import lane_distance
from mjnav.control.base import GridController
from mjnav.control.parameters import LEAST, MOST, GridParameters, Weight
from mjnav.control.problem.candidates import least_violating
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array, CandidateCosts, Status
from mjnav.settings import Range

AHEAD = 0.05 * np.arange(1, 101, dtype=float)  # [s] at which discs that move are looked for


@dataclass(frozen=True, slots=True, kw_only=True)
class DwaParameters(GridParameters):
    """The risk: its weight, and how far ahead it looks."""

    weight: Annotated[Weight, "of the clearance against the goal cost"] = 1.0
    clearance: Annotated[float, Range(LEAST, MOST, "m"), "free way beyond which more of it counts for nothing"] = 2.0
    moving: Annotated[bool, "whether discs go on at their mean velocity"] = False


class Dwa(GridController[DwaParameters]):
    """The admissible candidate of least goal cost and most clearance."""

    def evaluate(self, problem: Problem) -> CandidateCosts:
        """Goal cost plus weighted lack of clearance; infinite where the candidate is not admissible."""
        p, c, o = self.parameters, problem.candidates, problem.observation
        ways = self.ways(problem, c.v, c.omega)
        risk = 1.0 - np.minimum(ways, p.clearance) / p.clearance
        total = problem.goal_cost + p.weight * risk.max(axis=1)
        admissible = least_violating(self.excess(c.v, c.omega, ways))
        num_discs, num_obstacles = len(problem.reach.discs), len(o.obstacles)
        cone = np.zeros((len(total), num_obstacles + len(o.walls)))
        cone[:, list(problem.reach.discs)] = risk[:, :num_discs]
        cone[:, num_obstacles:] = risk[:, num_discs:-2]
        total = np.where(admissible, total, inf)
        return CandidateCosts(c.v, c.omega, problem.goal_cost, cone, risk[:, -2:], total, problem.nominal)

    def status(self, problem: Problem, costs: CandidateCosts, best: int) -> Status:
        """`infeasible` where the chosen candidate is not admissible."""
        v, omega = costs.v[[best]], costs.omega[[best]]
        if self.excess(v, omega, self.ways(problem, v, omega))[0] > 0.0:
            return Status.INFEASIBLE
        return super().status(problem, costs, best)

    def ways(self, problem: Problem, v: Array, omega: Array) -> Array:
        """dist [m] of controls (K,) to the discs in reach, to all walls and to both lane boundaries, (K, D + W + 2).

        The shared reach leaves out walls beyond `wall_horizon`, which may be nearer than `clearance`.
        """
        o, (x, y, _), to_robot = problem.observation, problem.mean_pose, problem.to_robot
        discs = problem.discs.means().take(problem.reach.discs)
        radius = self.limits.radius + self.parameters.safety_margin
        disc = np.column_stack([(discs.position - (x, y)) @ to_robot, discs.radius + radius])
        ends = (o.walls - (x, y)) @ to_robot
        wall = np.column_stack([ends.reshape(-1, 4), np.full(len(ends), radius)])
        line = np.zeros((0, 4))
        if o.lanes is not None:
            sides = ((o.lanes.left, o.lanes.left_offset, -1.0), (o.lanes.right, o.lanes.right_offset, 1.0))
            line = np.array([
                [
                    *(inwards * np.array(boundary[:2]) / np.hypot(*boundary[:2]) @ to_robot),
                    inwards * (float(lane_distance((x, y), boundary)) + noise.mean()),
                    self.limits.radius,
                ]
                for boundary, noise, inwards in sides
            ])  # fmt: skip
        ways = contact_distance(v, omega, disc, wall, line)
        if self.parameters.moving:
            ways[:, : len(disc)] = contact_distance_moving(v, omega, disc, discs.velocity @ to_robot, AHEAD)
        return ways if o.lanes is not None else np.column_stack([ways, np.full((len(v), 2), inf)])

    def excess(self, v: Array, omega: Array, ways: Array) -> Array:
        """By how much the way to a stop goes beyond the first contact [m], (K,)."""
        stop = np.maximum(
            v * v / (2.0 * self.limits.max_acceleration), np.abs(v * omega) / (2.0 * self.limits.max_turn_acceleration)
        )
        return np.maximum(stop - ways.min(axis=1), 0.0)
