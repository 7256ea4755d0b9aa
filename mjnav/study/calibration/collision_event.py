"""The event whose risk is predicted. It is the same for all methods, whatever form, margin and horizon they use:

    the robot, at the velocity that its control gives it, and the discs, at theirs, touch within 5 s:
    f > 0 for any person, leg or pillar, f in the segment form with R the sum of the radii (no margin).

The robot's velocity is the candidates': (v + dv) [cos(theta + (omega + domega) tau), sin(...)], tau = 0.4 s. Walls are
left out: they have a horizon of their own.
"""

from dataclasses import replace
from math import inf

import numpy as np

from mjnav.constraints.collision_cone import collision_cone
from mjnav.control.parameters import Parameters
from mjnav.control.problem.problem import Problem
from mjnav.messages import Observation, RobotLimits

# The methods' shared defaults; every disc counts.
EVENT = Parameters(safety_margin=0.0, sensing_range=inf, max_obstacles=1_000_000)


def share_of_pairs(observation: Observation, control: tuple[float, float], limits: RobotLimits) -> float:
    """The probability of the event by an observation's samples: the prediction of a method that uses them all.

    Robot samples are equally likely and obstacles independent of one another: with s_ij the share of obstacle j's
    samples that robot sample i hits, it is the mean over i of 1 - prod_j (1 - s_ij).
    """
    # Without candidates, the period has no effect.
    problem = Problem(replace(observation, walls=np.zeros((0, 2, 2))), limits, 1.0, EVENT)
    v, omega = np.array([control[0]]), np.array([control[1]])
    num = len(observation.robot_pose)
    missed = np.ones(num)
    for block in range(problem.cone.blocks.num_discs):
        f = problem.cone.samples(block, v, omega).reshape(-1, num)  # the robot's samples run fastest
        missed *= (f <= 0.0).mean(axis=0)
    return float(1.0 - missed.mean())


def share_of_draws(observation: Observation, control: tuple[float, float], limits: RobotLimits) -> float:
    """The share of joint draws in which the event happens: draw i is row i of all samples (each n or 1)."""
    pose, noise = observation.robot_pose, observation.control_noise
    heading = pose[:, 2] + (control[1] + noise[:, 1]) * EVENT.preview
    velocity = (control[0] + noise[:, :1]) * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    hit = np.zeros(len(velocity), bool)
    for disc in observation.obstacles:
        f = collision_cone(
            pose[:, :2] - disc.position,
            velocity - disc.velocity,
            limits.radius + disc.radius,
            form=EVENT.form,
            horizon=EVENT.horizon,
        )
        hit |= f > 0.0
    return float(hit.mean())
