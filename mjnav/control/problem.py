"""One decision's problem: candidates, their goal cost, the constraints at the mean and on samples, the nominal control.

What is costly is computed when it is first asked for.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mjnav.constraints.collision_cone import FORMS
from mjnav.control.candidates import Candidates, candidate_grid
from mjnav.control.goal_cost import GoalCost
from mjnav.control.lane_samples import lane_samples
from mjnav.control.nominal import cheapest, mean_violation
from mjnav.control.obstacles import Discs, Reach, blocks, in_reach
from mjnav.control.parameters import Parameters
from mjnav.control.sample_cone import ConeBlocks, ConeRule, SampleCone
from mjnav.geometry.angles import circular_mean
from mjnav.messages import Array, Observation, RobotLimits


@dataclass(frozen=True)
class Problem:
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
        pose = self.observation.robot_pose
        return np.array([*pose[:, :2].mean(axis=0), circular_mean(pose[:, 2])])

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
        """The samples of all obstacles."""
        return Discs.of(self.observation.obstacles)

    @cached_property
    def _means(self) -> Discs:
        return self.discs.means()

    @cached_property
    def reach(self) -> Reach:
        """The discs and walls that count."""
        return in_reach(self.observation, self._means, self.mean_pose, self.limits, self.parameters)

    @cached_property
    def cone(self) -> SampleCone:
        """The constraint samples of all discs and walls."""
        o = self.observation
        pairs = self._blocks(o.robot_pose[:, :2], self.discs)
        return SampleCone.of(pairs, self.rule, o.robot_pose, o.control_noise, self.parameters.preview)

    def _blocks(self, robot: Array, discs: Discs) -> ConeBlocks:
        taken = discs.take(self.reach.discs)
        return blocks(robot, taken, self.reach, self.observation, self.limits, self.parameters)

    @cached_property
    def _goal_cost(self) -> GoalCost:
        o, heading = self.observation, float(self.mean_pose[2])
        return GoalCost.of(self.candidates, heading, o.twist, self.limits, self.period, self.parameters)

    @cached_property
    def goal(self) -> Array:
        """J of every candidate, (K,)."""
        return self._goal_cost(self.mean_pose[:2], self.observation.goal)

    @cached_property
    def lanes(self) -> Array:
        """The lane constraints' samples, (2, K, N); N = 0 without lanes."""
        o, c = self.observation, self.candidates
        if o.lanes is None:
            return np.zeros((2, len(c.v), 0))
        offsets = (o.lanes.left_offset, o.lanes.right_offset)
        margin = self.limits.radius
        return lane_samples(o.lanes, o.robot_pose, o.control_noise, offsets, c.v, c.omega, margin, self.parameters)

    @cached_property
    def _mean_blocks(self) -> ConeBlocks:
        return self._blocks(self.mean_pose[None, :2], self._means)

    @cached_property
    def _mean_velocity(self) -> tuple[Array, Array]:
        """The mean robot's velocity at every candidate, (K,) each."""
        heading = self.mean_pose[2] + (self.candidates.omega + self.mean_noise[0, 1]) * self.parameters.preview
        speed = self.candidates.v + self.mean_noise[0, 0]
        return speed * np.cos(heading), speed * np.sin(heading)

    @cached_property
    def violation(self) -> Array:
        """By how much each candidate violates the constraints at the mean, (K,); 0 where it meets them all."""
        return self._violation_at(self.mean_pose, self._mean_blocks)

    @cached_property
    def nominal(self) -> int:
        """The cheapest candidate that meets every constraint at the mean; where none does, the least violation."""
        return self.cheapest(self.goal, self.violation)

    def nominal_beside(self, shift: Array) -> int:
        """The nominal control if the robot's mean position were `shift` (2,) away."""
        pose = self.mean_pose + np.array([shift[0], shift[1], 0.0])
        moved = replace(self._mean_blocks, x=self._mean_blocks.x + shift[0], y=self._mean_blocks.y + shift[1])
        return self.cheapest(self._goal_cost(pose[:2], self.observation.goal), self._violation_at(pose, moved))

    def cheapest(self, cost: Array, violation: Array) -> int:
        """Which candidate is nominal where the candidates have this goal cost and violation, (K,) each."""
        return cheapest(cost, violation)

    def _violation_at(self, pose: Array, pairs: ConeBlocks) -> Array:
        c, lanes = self.candidates, self.observation.lanes
        violation = mean_violation(pairs, self.rule, *self._mean_velocity)
        if lanes is not None:
            offsets = (lanes.left_offset.mean(keepdims=True), lanes.right_offset.mean(keepdims=True))
            margin = self.limits.radius
            d = lane_samples(
                lanes, pose[None], self.mean_noise, offsets, c.v, c.omega, margin, self.parameters, clip=False
            )  # fmt: skip
            violation += np.maximum(d, 0.0).sum(axis=(0, 2))
        return violation
