"""One decision's problem: candidates, their goal cost, the constraints at the mean and on samples, the nominal control.

Each part is computed when it is first asked for.
"""

from dataclasses import dataclass
from functools import cached_property
from math import inf

import numpy as np

from mjnav.constant import Constant
from mjnav.constraints.collision_cone import FORMS
from mjnav.control.kernels.cone_kernel import ConeRule
from mjnav.control.parameters import Parameters
from mjnav.control.problem.candidates import Candidates, candidate_grid, cheapest, least_violating
from mjnav.control.problem.goal_cost import GoalCost
from mjnav.control.problem.obstacles import Discs, Reach, blocks, discs_in_reach, straightened, walls_in_reach
from mjnav.control.problem.samples import SampleCone, lane_samples
from mjnav.geometry.angles import mean_pose
from mjnav.messages import Array, Observation, RobotLimits


@dataclass(frozen=True)
class Problem(Constant):
    """All that a method needs to choose among the candidates of one observation."""

    observation: Observation
    limits: RobotLimits
    period: float
    parameters: Parameters

    @cached_property
    def candidates(self) -> Candidates:
        """The K controls to choose from."""
        p = self.parameters
        return candidate_grid(self.observation.twist, self.limits, self.period, p.num_v, p.num_omega, p.window)

    @cached_property
    def mean_pose(self) -> Array:
        """Mean of the robot's samples, (3,)."""
        return mean_pose(self.observation.robot_pose)

    @cached_property
    def to_robot(self) -> Array:
        """(2, 2), from the right: turns vectors of the world into the mean robot's frame; its columns are the axes."""
        c, s = np.cos(self.mean_pose[2]), np.sin(self.mean_pose[2])
        return np.array([[c, -s], [s, c]])

    @cached_property
    def mean_noise(self) -> Array:
        """Mean of the actuation noise's samples, (1, 2)."""
        return self.observation.control_noise.mean(axis=0, keepdims=True)

    @cached_property
    def rule(self) -> ConeRule:
        """How f is computed."""
        p = self.parameters
        return ConeRule(FORMS[p.form], p.horizon, p.wall_horizon, -p.clip)

    @cached_property
    def discs(self) -> Discs:
        """The samples of all obstacles, each on the straight line to where it is after `horizon`."""
        return self.discs_until(self.parameters.horizon)

    def discs_until(self, horizon: float) -> Discs:
        """The same with another horizon [s], which makes a difference where a future is predicted."""
        obstacles = self.observation.obstacles
        if all(obstacle.future is None for obstacle in obstacles):
            return self._drawn
        return Discs.of([straightened(obstacle, horizon) for obstacle in obstacles])

    @cached_property
    def _drawn(self) -> Discs:
        """The samples of all obstacles, each with its velocity of now."""
        return Discs.of(self.observation.obstacles)

    @cached_property
    def _drawn_means(self) -> Discs:
        return self._drawn.means()

    @cached_property
    def _means(self) -> Discs:
        return self._drawn_means if self.discs is self._drawn else self.discs.means()

    @cached_property
    def near_discs(self) -> tuple[int, ...]:
        """The discs that count, nearest first."""
        return discs_in_reach(self._drawn_means, self.mean_pose, self.limits, self.parameters)

    @cached_property
    def reach(self) -> Reach:
        """The discs and walls that count."""
        return Reach(self.near_discs, walls_in_reach(self.observation, self.limits, self.parameters))

    @cached_property
    def cone(self) -> SampleCone:
        """The constraint samples of all discs and walls."""
        return self._cone_of(self.reach, self.discs.take(self.reach.discs))

    @property
    def nearest_cone(self) -> SampleCone:
        """A cone whose first block is the nearest disc: all of it where it is known, else of that disc alone."""
        if "cone" in vars(self):
            return self.cone
        nearest = [straightened(self.observation.obstacles[j], self.parameters.horizon) for j in self.near_discs[:1]]
        return self._cone_of(Reach(self.near_discs[:1], ()), Discs.of(nearest))

    def _cone_of(self, reach: Reach, discs: Discs) -> SampleCone:
        o = self.observation
        surroundings = blocks(discs, reach, o, self.limits, self.parameters)
        return SampleCone.of(surroundings, self.rule, o.robot_pose, o.control_noise, self.parameters.preview)

    @cached_property
    def _mean_cone(self) -> SampleCone:
        """One sample of everything: the mean."""
        surroundings, discs = self.cone.blocks, list(self.reach.discs)
        surroundings = surroundings._replace(
            start=np.arange(len(surroundings.start)),
            position=self._means.position[discs],
            velocity=self._means.velocity[discs],
        )
        return SampleCone.of(surroundings, self.rule, self.mean_pose[None], self.mean_noise, self.parameters.preview)

    @cached_property
    def _goal_at(self) -> GoalCost:
        o, heading = self.observation, float(self.mean_pose[2])
        return GoalCost.of(self.candidates, heading, o.twist, self.limits, self.period, self.parameters)

    @cached_property
    def goal_cost(self) -> Array:
        """J of every candidate, (K,)."""
        return self._goal_at(self.mean_pose[:2], self.observation.goal)

    @cached_property
    def lanes(self) -> Array:
        """The lane constraints' samples, left and right, (2, K, N); (0, K, N) without lanes."""
        o, c = self.observation, self.candidates
        if o.lanes is None:
            return np.zeros((0, len(c.v), len(o.robot_pose)))
        offsets = (o.lanes.left_offset, o.lanes.right_offset)
        margin = self.limits.radius
        return lane_samples(o.lanes, o.robot_pose, o.control_noise, offsets, c.v, c.omega, margin, self.parameters)

    @cached_property
    def violation(self) -> Array:
        """By how much each candidate violates the constraints at the mean, (K,); 0 where it meets them all."""
        return self._violation_at(np.zeros((1, 2)))[0]

    @cached_property
    def nominal(self) -> int:
        """The cheapest candidate that meets every constraint at the mean; where none does, the least violation."""
        return self.cheapest(self.goal_cost[None], self.violation[None])[0]

    def nominals_at(self, shifts: Array) -> list[int]:
        """The nominal controls if the robot's mean position were `shifts` (P, 2) away."""
        position = (self.mean_pose[:2] + shifts).T[:, :, None]
        return self.cheapest(self._goal_at(position, self.observation.goal), self._violation_at(shifts))

    def cheapest(self, cost: Array, violation: Array) -> list[int]:
        """The nominal candidates, (P,), for goal costs and violations (P, K).

        The cheapest of those that violate nothing; where all violate, of those that violate least.
        """
        return cheapest(np.where(least_violating(violation), cost, inf)).tolist()

    def _violation_at(self, shifts: Array) -> Array:
        """(P, K), with the robot's mean position `shifts` (P, 2) away."""
        c, o = self.candidates, self.observation
        violation = self._mean_cone.violation(c.v, c.omega, shifts)
        if o.lanes is not None:
            pose, noise = np.tile(self.mean_pose, (len(shifts), 1)), np.tile(self.mean_noise, (len(shifts), 1))
            pose[:, :2] += shifts
            ones = np.ones(len(shifts))
            offsets = (o.lanes.left_offset.mean() * ones, o.lanes.right_offset.mean() * ones)
            margin = self.limits.radius
            d = lane_samples(o.lanes, pose, noise, offsets, c.v, c.omega, margin, self.parameters, clip=False)
            violation += np.maximum(d, 0.0).sum(axis=0).T
        return violation
