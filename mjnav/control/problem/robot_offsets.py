"""The robot's samples beside its mean position, for methods that plan, and how far they are beyond the lanes."""

import numpy as np

from mjnav.constraints.lane import lane_distance
from mjnav.control.problem.problem import Problem
from mjnav.messages import Array


def robot_offsets(problem: Problem) -> Array:
    """The robot's samples less their mean position, (2, N) [m].

    Each includes the drift of its actuation noise over one period; the next decision observes and corrects it.
    """
    o, heading = problem.observation, problem.observation.robot_pose[:, 2]
    drift = problem.period * o.control_noise[:, 0]
    return (o.robot_pose[:, :2] - problem.mean_pose[:2]).T + drift * np.stack([np.cos(heading), np.sin(heading)])


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
