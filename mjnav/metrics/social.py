"""Social forces between the robot and the people, as HuNavSim sums them up (Perez-Higueras et al. 2023).

The force on body i from body j per unit of mass is that of Moussaid et al. (2009),

    D = lambda (v_i - v_j) + e,   t = D / |D|,   n its left normal,   theta the angle from t to e,   B = gamma |D|,
    f_ij = -A exp(-d / B) [exp(-(n' B theta)^2) t + sign(theta) exp(-(n B theta)^2) n],

with d, e distance and unit vector from i to j. It is antisymmetric, f_ji = -f_ij: the robot pushes a person as hard as
the person pushes it. The nearest wall, leg or pillar pushes the robot with A_o exp(-d_o / B_o) from its surface.

`mjnav.motion.social_force` has this law for people's decisions, as a kernel; here it is an expression over all ticks,
so that a log is inspected without compiled code. A test holds the two equal.
"""

from dataclasses import dataclass

import numpy as np

from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import by_blocks
from mjnav.metrics.kinematics import velocity
from mjnav.metrics.safety import thing_distance
from mjnav.scenarios.spec import Scenario

# HuNavSim's constants, those of the library lightsfm.
STRENGTH = 2.1  # [m/s^2] A
VELOCITY_WEIGHT = 2.0  # [s/m] lambda
RANGE = 0.35  # [m] gamma
TURN_SHARPNESS, SLOW_SHARPNESS = 2.0, 3.0  # [1/m] n, n'
OBSTACLE_STRENGTH = 10.0  # [m/s^2] A_o
OBSTACLE_RANGE = 0.2  # [m] B_o
STRAIGHT = 1e-9  # [rad] of theta that are rounding: there sign(theta) is 0


@dataclass(frozen=True, slots=True)
class SocialForces:
    """Integrals over time of forces per unit of mass [m/s]; each tick's force stands for the period after it.

    HuNavSim adds up the samples in place of integrating: its sums are these over the sampling period. Its force on the
    robot adds the sizes of the single forces, and so is that on the people; here it is the size of their sum.
    """

    on_people: float  # sum over people of |f_ir|
    on_robot: float  # |sum over people of f_ri|
    work: float  # on_people + on_robot + |the force of the nearest thing on the robot|


def social_forces(trajectory: Trajectory, scenario: Scenario) -> SocialForces | None:
    """The forces of a run; None without people. People count whether they see the robot or not."""
    if not scenario.people:
        return None
    columns = (trajectory.robot_pose, velocity(trajectory), trajectory.people_position, trajectory.people_velocity)
    on_people, on_robot = by_blocks(_sizes, *(column[:-1] for column in columns)).T
    distance = thing_distance(trajectory.robot_pose[:-1, :2], scenario) - scenario.robot.radius
    of_things = OBSTACLE_STRENGTH * np.exp(-distance / OBSTACLE_RANGE)
    period = np.diff(trajectory.time)
    people, robot, things = (float(period @ force) for force in (on_people, on_robot, of_things))
    return SocialForces(people, robot, people + robot + things)


def _sizes(pose: Array, own: Array, people: Array, walking: Array) -> Array:
    """The sum of the sizes of the forces between robot and people, and the size of their sum, (T, 2) [m/s^2]."""
    force = np.nan_to_num(pair_force(people - pose[:, None, :2], own[:, None] - walking))
    total = force.sum(axis=1)
    return np.column_stack([np.hypot(force[..., 0], force[..., 1]).sum(axis=1), np.hypot(total[:, 0], total[:, 1])])


def pair_force(apart: Array, closing: Array) -> Array:
    """f_ij for p_j - p_i (..., 2) [m] and v_i - v_j (..., 2) [m/s], (..., 2) [m/s^2]; NaN at one and the same place."""
    with np.errstate(invalid="ignore", divide="ignore"):
        d = np.hypot(apart[..., 0], apart[..., 1])[..., None]
        e = apart / d
        way = VELOCITY_WEIGHT * closing + e
        size = np.hypot(way[..., 0], way[..., 1])[..., None]
        t = way / size
        cross = t[..., :1] * e[..., 1:] - t[..., 1:] * e[..., :1]
        theta, reach = np.arctan2(cross, (t * e).sum(-1, keepdims=True)), RANGE * size
        slow = np.exp(-d / reach - (SLOW_SHARPNESS * reach * theta) ** 2)
        side = np.where(np.abs(theta) < STRAIGHT, 0.0, np.sign(theta))
        turn = side * np.exp(-d / reach - (TURN_SHARPNESS * reach * theta) ** 2)
        normal = np.concatenate([-t[..., 1:], t[..., :1]], axis=-1)
        return -STRENGTH * (slow * t + turn * normal)
