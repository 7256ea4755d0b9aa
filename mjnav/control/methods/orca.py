"""`orca`: optimal reciprocal collision avoidance on a differential drive, at the means only.

The velocity nearest to the preferred one within half-planes that keep clear of every disc for `time_horizon`,

    V* = argmin |V - V_pref|   subject to   n_j . (V - (V_now + alpha u_j)) >= 0

(van den Berg, Guy, Lin & Manocha 2011, "Reciprocal n-Body Collision Avoidance"; u_j and n_j as in
`constraints.velocity_obstacle`). The paper has a `responsibility` alpha of 1/2 between robots. With 1, the class's
default, nobody is expected to react; what tuning found is little more than 1/2.

A differential drive follows V through its effective centre, a point D ahead of the axle (Snape, van den Berg, Guy &
Manocha 2010, "Smooth and Collision-Free Navigation for Multiple Robots under Differential-Drive Constraints"). With e
the heading and e' the direction to its left, that point moves at

    V = v e + D omega e',   so that   v = V . e,   omega = V . e' / D,

in any direction, and the disc of radius r + D about it covers the robot. In these coordinates what is reachable within
one period is a box, which V never leaves. V_pref leads to the goal as the goal cost has it; where the goal lies behind,
it points abeam, so that the robot turns.

A wall gives the half-plane against its nearest point p with V_now = 0, as the paper advises for obstacles at rest:
V . p / |p| <= max(0, |p| - R) / T, T the `wall_horizon`; the robot may drive along the wall and away from it. A lane
boundary is not to be crossed within `lane_horizon`.

With a `spread` k the radius of each disc is larger by k sqrt(tr(Sigma_robot + Sigma_j) / 2): a margin for uncertainty
that the published method does not have.

Infeasible: no reachable V obeys all half-planes. Then the largest violation of any of them is made as small as it can
be.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.constraints.velocity_obstacle import nearest_velocity, velocity_obstacle_exits
from mjnav.constraints.walls import lane_distance
from mjnav.control.base import ProblemController, status_of
from mjnav.control.parameters import LEAST, MOST, Positive, Seconds, SightParameters
from mjnav.control.problem.problem import Problem
from mjnav.geometry.angles import shortest_turn
from mjnav.messages import Array, Decision, Observation, Status
from mjnav.motion.unicycle import reachable
from mjnav.settings import Range


@dataclass(frozen=True, slots=True, kw_only=True)
class OrcaParameters(SightParameters):
    """The half-planes."""

    time_horizon: Annotated[Seconds, "tau, time ahead free of collisions with discs"] = 5.0
    effective_centre: Annotated[
        float, Range(LEAST, MOST, "m"), "D, distance of the controlled point ahead of the axle"
    ] = 0.25
    responsibility: Annotated[Positive, "alpha, share of the avoidance that the robot takes on"] = 1.0
    wall_horizon: Annotated[Seconds, "T, time ahead free of collisions with walls"] = 2.0
    lane_horizon: Annotated[Seconds, "time ahead in which no lane boundary is crossed"] = 1.0
    spread: Annotated[
        float, Range(0.0, MOST), "standard deviations of the relative position that are added to the radius of a disc"
    ] = 0.0


class Orca(ProblemController[OrcaParameters]):
    """The reachable velocity of the effective centre nearest to the preferred one, within the half-planes."""

    def decide(self, observation: Observation) -> Decision:
        """The control that moves the effective centre at V*."""
        problem = self.problem(observation)
        low, high = reachable(observation.twist, self.limits, self.period)
        scale = np.array([1.0, self.parameters.effective_centre])  # of (v, omega) to V in the robot's frame
        normal, offset = self.half_planes(problem)
        velocity, violation = nearest_velocity(normal, offset, low * scale, high * scale, self.preferred(problem))
        v, omega = np.clip(velocity / scale, low, high).tolist()
        infeasible = Status.INFEASIBLE if violation > 0.0 else None
        return Decision(v, omega, status_of(observation, v, omega, infeasible))

    def preferred(self, problem: Problem) -> Array:
        """V_pref (2,) [m/s] in the robot's frame."""
        p = self.parameters
        x, y = (problem.observation.goal - problem.mean_pose[:2]) @ problem.to_robot
        speed = min(p.preferred_speed, self.limits.max_speed, np.hypot(x, y) / p.approach_time)
        angle = np.clip(shortest_turn(np.arctan2(y, x)), -0.5 * np.pi, 0.5 * np.pi)
        return speed * np.array([np.cos(angle), np.sin(angle)])

    def half_planes(self, problem: Problem) -> tuple[Array, Array]:
        """n (n, 2) and c (n,) [m/s] of n . V >= c in the robot's frame: discs, nearest first, walls, lanes."""
        parts = [self._discs(problem), self._walls(problem), self._lanes(problem)]
        return np.concatenate([normal for normal, _ in parts]), np.concatenate([offset for _, offset in parts])

    @property
    def _radius(self) -> float:
        """Of the disc about the effective centre that covers the robot [m]."""
        return self.limits.radius + self.parameters.effective_centre

    def _discs(self, problem: Problem) -> tuple[Array, Array]:
        p, to_robot = self.parameters, problem.to_robot
        near = problem.discs_until(p.time_horizon).take(problem.reach.discs)
        discs = near.means()
        now = problem.observation.twist * np.array([1.0, p.effective_centre])
        position = (discs.position - problem.mean_pose[:2]) @ to_robot - np.array([p.effective_centre, 0.0])
        radius = discs.radius + self._radius + p.safety_margin
        if p.spread:
            own = problem.observation.robot_pose[:, :2].var(axis=0)
            radius += p.spread * np.sqrt(0.5 * (own + near.variances()).sum(axis=1))
        relative_velocity = now - discs.velocity @ to_robot
        normal, depth = velocity_obstacle_exits(position, relative_velocity, radius, p.time_horizon, self.period)
        return normal, normal @ now + p.responsibility * depth

    def _walls(self, problem: Problem) -> tuple[Array, Array]:
        p = self.parameters
        ends = (problem.observation.walls[list(problem.reach.walls)] - problem.mean_pose[:2]) @ problem.to_robot
        ends = ends - np.array([p.effective_centre, 0.0])
        start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
        length_squared = np.maximum((along * along).sum(axis=1), np.finfo(float).tiny)
        share = np.clip(-(start * along).sum(axis=1) / length_squared, 0.0, 1.0)
        nearest = start + share[:, None] * along
        distance = np.hypot(nearest[:, 0], nearest[:, 1])
        # On the wall itself no direction leads away; backwards is where the robot came from.
        towards = (
            np.where(distance[:, None] > 0.0, nearest, (1.0, 0.0)) / np.where(distance > 0.0, distance, 1.0)[:, None]
        )
        room = np.maximum(distance - self._radius - p.safety_margin, 0.0)
        return -towards, -room / p.wall_horizon

    def _lanes(self, problem: Problem) -> tuple[Array, Array]:
        lanes, to_robot = problem.observation.lanes, problem.to_robot
        if lanes is None:
            return np.zeros((0, 2)), np.zeros(0)
        centre = problem.mean_pose[:2] + self.parameters.effective_centre * to_robot[:, 0]
        normal, offset = np.empty((2, 2)), np.empty(2)
        sides = ((lanes.left, lanes.left_offset, -1.0), (lanes.right, lanes.right_offset, 1.0))
        for i, (line, noise, inwards) in enumerate(sides):
            normal[i] = inwards * np.array(line[:2]) @ to_robot / np.hypot(*line[:2])
            room = inwards * (float(lane_distance(centre, line)) + float(noise.mean())) - self._radius
            offset[i] = -room / self.parameters.lane_horizon
        return normal, offset
