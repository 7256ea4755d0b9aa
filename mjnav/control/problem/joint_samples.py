"""Joint samples of robot, obstacles and lane boundaries for methods that plan, and the violation of rollouts there.

Joint sample s is sample s of the robot's position, of every obstacle's path and of both lane boundaries: bodies that
are believed independently are drawn independently, in random order. Where an obstacle has fewer samples than the robot
they are used again.

The robot's samples are taken relative to its mean position; those of a lane boundary say how far each of the robot's
samples is beyond it.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mjnav.compile.compiled import Cube, Matrix, exact
from mjnav.constraints.walls import lane_distance
from mjnav.control.kernels.violation import meet_discs, meet_lane, meet_walls
from mjnav.control.problem.obstacles import Reach, positions_at
from mjnav.control.problem.problem import Problem
from mjnav.control.rollouts import Rollouts, parts_of
from mjnav.messages import Array, ObstacleSamples


def robot_offsets(problem: Problem) -> Array:
    """The robot's samples less their mean position, (2, N) [m].

    Each includes the drift of its actuation noise over one period; the next decision observes and corrects it.
    """
    o, heading = problem.observation, problem.observation.robot_pose[:, 2]
    drift = problem.period * o.control_noise[:, 0]
    offsets = (o.robot_pose[:, :2] - problem.mean_pose[:2]).T.copy()
    offsets[0] += drift * np.cos(heading)
    offsets[1] += drift * np.sin(heading)
    return offsets


def lane_excesses(problem: Problem, offsets: Array) -> tuple[tuple[Array, Array], ...]:
    """For each lane boundary its outward normal (2,) and by how much each sample is beyond it at the mean, (N,) [m].

    `offsets` (2, N) are those of `robot_offsets`. A robot that moves by p is beyond by normal . p more. Without lanes
    there are none.
    """
    lanes, mean, found = problem.observation.lanes, problem.mean_pose[:2], []
    if lanes is not None:
        sides = ((lanes.left, lanes.left_offset, 1.0), (lanes.right, lanes.right_offset, -1.0))
        for line, noise, outward in sides:
            normal = outward * np.array(line[:2]) / np.hypot(*line[:2])
            beyond = outward * (lane_distance(mean, line) + noise) + problem.limits.radius
            found.append((normal, normal @ offsets + beyond))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class Covering:
    """The discs that the robot is; what is ahead of its centre turns with it."""

    discs: tuple[tuple[float, float], ...]  # [m] ahead of the centre; radius, with the safety margin [m]
    heading: float  # [rad] at the start

    @classmethod
    def of(cls, problem: Problem) -> "Covering":
        """The robot of a problem, at its mean heading."""
        margin, pose = problem.parameters.safety_margin, problem.mean_pose
        return cls(tuple((ahead, radius + margin) for ahead, radius in problem.limits.discs), float(pose[2]))

    def paths(self, rollouts: Rollouts) -> Iterator[tuple[Rollouts, float]]:
        """Of each disc its paths and its radius."""
        for ahead, radius in self.discs:
            yield rollouts.of_disc(ahead, self.heading), radius


@dataclass(frozen=True, slots=True)
class JointSamples:
    """All samples of an observation, relative to the robot's mean position."""

    offsets: Array  # (2, S) [m] of the robot's samples
    moving: tuple[Array, Array]  # x and y (T, B, S) [m] of what moves less the robot's offsets
    moving_radius: Array  # (B,) [m]
    standing: Array  # (W, 4) [m] ax, ay, bx, by of what stands, a point twice for a disc
    standing_radius: Array  # (W,) [m]
    lanes: tuple[tuple[Array, Array], ...]  # (2,) outward normal and (S,) samples of what the robot is beyond by [m]
    times: Array  # (T,) [s] of the ends of all steps
    parts: int  # of each step, at whose ends rollouts are compared with what stands
    robot: Covering

    @classmethod
    def of(cls, problem: Problem, reach: Reach, steps: int, step: float) -> "JointSamples":
        """The discs and walls in reach, for `steps` steps of `step` [s]."""
        o, mean, offsets = problem.observation, problem.mean_pose[:2], robot_offsets(problem)
        near = [o.obstacles[j] for j in reach.discs]
        moves = [_moves(body) for body in near]
        moving = [body for body, goes in zip(near, moves, strict=True) if goes]
        standing = [body for body, goes in zip(near, moves, strict=True) if not goes]
        points = np.array([body.position[0] for body in standing]).reshape(-1, 2) - mean
        walls = (o.walls[list(reach.walls)] - mean).reshape(-1, 4)
        times = step * np.arange(1, steps + 1, dtype=float)
        return cls(
            offsets=offsets,
            moving=_relative_paths(moving, mean, offsets, times),
            moving_radius=np.array([body.radius for body in moving]),
            standing=np.concatenate([np.hstack([points, points]), walls]),
            standing_radius=np.array([*(body.radius for body in standing), *np.zeros(len(walls))]),
            lanes=lane_excesses(problem, offsets),
            times=times,
            parts=parts_of(problem.limits, step),
            robot=Covering.of(problem),
        )

    def violation(self, rollouts: Rollouts, margin: Array, fading: Array, standing: float) -> Array:
        """h (K, S) of rollouts of as many steps, of the deepest of the robot's discs.

        Of what moves m_t is `margin` (T,) [m] and gamma_t `fading` (T,), of what stands m is `standing` [m].
        """
        ones = np.ones(len(self.moving_radius))
        h = np.zeros((rollouts.x.shape[1], self.offsets.shape[1]))
        m = margin[:, None] * ones
        for r, radius in self.robot.paths(rollouts):
            reach = self.moving_radius + radius + m
            meet_discs(h, r.x, r.y, *self.moving, reach, 1.0 / m, fading[:, None] * ones)
            if len(self.standing):
                reach = self.standing_radius + radius + standing
                meet_walls(h, *r.between(self.parts), *self.offsets, self.standing, reach, standing)
        for normal, excess in self.lanes:
            meet_lane(h, rollouts.x, rollouts.y, normal, excess, standing)
        return h


def _moves(body: ObstacleSamples) -> bool:
    return body.future is not None or len(body.position) > 1 or body.velocity.tolist() != [[0.0, 0.0]]


def _relative_paths(bodies: list[ObstacleSamples], mean: Array, offsets: Array, times: Array) -> tuple[Array, Array]:
    """x and y (T, B, S) of the bodies' samples at `times` less the robot's samples, from its `mean` position."""
    x, y = np.empty((2, len(times), len(bodies), offsets.shape[1]))
    origins = mean[:, None] + offsets
    for b, body in enumerate(bodies):
        _relate(x, y, b, positions_at(body, times), origins)
    return x, y


@exact
def _relate(x: Cube, y: Cube, b: int, positions: Cube, origins: Matrix):
    """Sets x and y (T, B, S) of body b by its samples' `positions` (T, M, 2), less `origins` (2, S); M may be less."""
    for t in range(x.shape[0]):
        for s in range(x.shape[2]):
            i = s % positions.shape[1]
            x[t, b, s], y[t, b, s] = positions[t, i, 0] - origins[0, s], positions[t, i, 1] - origins[1, s]
