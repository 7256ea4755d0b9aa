"""How often a control collides if the robot keeps it and people keep their velocities.

From the true state the robot accelerates to (v, omega) within its limits and keeps it for the event's 5 s: an arc,
where the candidates' cone has a straight line. Each draw of the actuation noise holds for 0.1 s, as in the world.
People walk straight on at their true velocities; neither contacts nor walls stop anybody.
"""

import numpy as np

from mjnav.constraints.collision_cone import cone_segment
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Cube, Matrix, Vector
from mjnav.messages import Array, Observation, RobotLimits
from mjnav.motion.diff_drive import ramp_mean
from mjnav.noise import NOISE_WINDOW
from mjnav.study.calibration.collision_event import EVENT

NUM_WINDOWS = round(EVENT.horizon / NOISE_WINDOW)


@kernel
def _num_hits(
    x0: float,
    y0: float,
    heading0: float,
    twist: Matrix,
    noise: Cube,
    ox: Vector,
    oy: Vector,
    ovx: Vector,
    ovy: Vector,
    radius: Vector,
    window: float,
):
    """The number of rollouts, one for each row of `noise` (n, S, 2), that come nearer to a disc than its R."""
    hits = 0
    for i in range(noise.shape[0]):
        x, y, heading, hit = x0, y0, heading0, False
        for s in range(noise.shape[1]):
            # The exact arc of a window; the cone sees its chord, which is off by v omega T^2 / 8, at most 2 mm.
            half = 0.5 * window * (twist[s, 1] + noise[i, s, 1])
            speed = (twist[s, 0] + noise[i, s, 0]) * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
            vx, vy = speed * np.cos(heading + half), speed * np.sin(heading + half)
            time = s * window
            for j in range(ox.size):
                rx, ry = x - (ox[j] + time * ovx[j]), y - (oy[j] + time * ovy[j])
                hit |= cone_segment(rx, ry, vx - ovx[j], vy - ovy[j], radius[j] * radius[j], window) > 0.0
            if hit:
                break
            x += window * vx
            y += window * vy
            heading += 2.0 * half
        hits += hit
    return hits


def share_of_rollouts(truth: Observation, control: tuple[float, float], limits: RobotLimits, noise: Array) -> float:
    """The share of rollouts that touch a person, leg or pillar.

    `truth` is an observation with one pose and one state of each obstacle; its twist is the command before `control`.
    `noise` (n, S, 2) is the actuation noise of n rollouts in S windows of 0.1 s.
    """
    twist, before = np.empty((noise.shape[1], 2)), truth.twist
    for s in range(len(twist)):
        twist[s], before = ramp_mean(before, control, limits, NOISE_WINDOW)
    x, y, heading = truth.robot_pose[0].tolist()
    position = np.array([disc.position[0] for disc in truth.obstacles]).reshape(-1, 2)
    velocity = np.array([disc.velocity[0] for disc in truth.obstacles]).reshape(-1, 2)
    radius = np.array([limits.radius + disc.radius for disc in truth.obstacles])
    columns = [np.ascontiguousarray(a) for a in (*position.T, *velocity.T)]
    return _num_hits(x, y, heading, twist, noise, *columns, radius, NOISE_WINDOW) / len(noise)
