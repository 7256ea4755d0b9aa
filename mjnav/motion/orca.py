"""Optimal reciprocal collision avoidance: the velocity nearest to the wanted one that keeps clear of all, if all do so.

    V = argmin |V - V_pref|   subject to   n_j . (V - (V_now + alpha_j u_j)) >= 0  for all j,   |V| <= V_max

(van den Berg, Guy, Lin & Manocha 2011, "Reciprocal n-Body Collision Avoidance"; u_j, n_j in
`constraints.velocity_obstacle`, the linear programme and what is done where it has no solution in
`constraints.half_planes`). A person takes alpha = 1/2 of the change of velocity that avoids another person, who is
expected to take the rest; of the robot whatever share is given; and all of it, 1, of pillars, discs at rest, and of a
robot that they take for a thing at rest.

To the robot a person keeps a personal space s: its radius counts for s more, but never for more than the gap that there
is, so that who is nearer already comes no nearer and is not thrown back.

Walls and tables are convex boxes. Theirs is the half-plane against the nearest point p, with V_now = 0 as the paper
advises for obstacles:  V . p / |p| <= max(0, |p| - r) / T. V = 0 obeys all of them, and they are hard: where people are
too dense, they give way to one another less, but walk into no wall.
"""

from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Flags, Indices, Matrix, Vector, exact
from mjnav.constraints.velocity_obstacle import leave_velocity_obstacle, nearest_within
from mjnav.geometry.floor import box_surface

AMONG_PEOPLE = 0.5  # alpha between people (van den Berg et al. 2011)


class OrcaSettings(NamedTuple):
    """What a person looks at."""

    horizon: float  # tau [s] free of collisions with people, the robot and pillars
    wall_horizon: float  # T [s] free of collisions with walls and tables
    neighbour_distance: float  # [m] between centres beyond which nobody counts
    max_neighbours: int  # the nearest of them
    robot_share: float  # alpha against the robot
    personal_space: float  # s [m] from the robot's surface
    period: float  # [s] in which those who overlap part


@exact
def _nearest(order, square, position, body, unseen, within, most):
    """Writes the `most` nearest others within a distance [m] of a body to `order`, ties by index; returns how many."""
    num = 0
    for j in range(len(position)):
        dx, dy = position[j, 0] - position[body, 0], position[j, 1] - position[body, 1]
        d = dx * dx + dy * dy
        if j in (body, unseen) or not d <= within * within or (num == most and d >= square[num - 1]):
            continue
        place = num if num < most else num - 1
        while place > 0 and square[place - 1] > d:
            order[place], square[place] = order[place - 1], square[place - 1]
            place -= 1
        order[place], square[place] = j, d
        num = min(num + 1, most)
    return num


@exact
def velocities(
    position: Matrix,
    velocity: Matrix,
    radius: Vector,
    walkers: Indices,
    desired: Matrix,
    max_speed: Vector,
    sees_robot: Flags,
    at_rest: Flags,
    robot: int,
    discs: Matrix,
    boxes: Matrix,
    settings: OrcaSettings,
):
    """Velocities (n, 2) [m/s] of the n walkers among m bodies: people, and the robot as one more.

    position, velocity (m, 2), radius (m,): bodies at NaN are not there. `walkers` (n,): their places among the bodies;
    `desired` (n, 2): V_pref, `max_speed` (n,): V_max. `robot` is the robot's place among the bodies, or -1; it is no
    body for walkers who do not see it (`sees_robot` (n,)), and a thing at rest for those who take it so (`at_rest`
    (n,)). `discs` (k, 3) x, y, radius; `boxes` (l, 6) as in `geometry.floor.Floor`.
    """
    num_bodies = len(position)
    order, square = np.empty(num_bodies, np.int64), np.empty(num_bodies)
    out = np.zeros((len(walkers), 2))
    planes = np.empty((len(boxes) + len(discs) + num_bodies, 3))
    no_box = np.array([-np.inf, -np.inf, np.inf, np.inf])
    for i in range(len(walkers)):
        body = walkers[i]
        x, y, vx, vy, r = position[body, 0], position[body, 1], velocity[body, 0], velocity[body, 1], radius[body]
        if np.isnan(x):
            continue
        num = 0
        for k in range(len(boxes)):
            distance, nx, ny = box_surface(x, y, boxes[k])
            room = max(distance - r, 0.0) / settings.wall_horizon
            if room < max_speed[i]:
                planes[num, 0], planes[num, 1], planes[num, 2] = nx, ny, -room
                num += 1
        hard = num
        for k in range(len(discs)):
            px, py, reach = discs[k, 0] - x, discs[k, 1] - y, discs[k, 2] + r
            if np.sqrt(px * px + py * py) < reach + settings.horizon * max_speed[i]:
                nx, ny, depth = leave_velocity_obstacle(px, py, vx, vy, reach, settings.horizon, settings.period)
                planes[num, 0], planes[num, 1], planes[num, 2] = nx, ny, nx * vx + ny * vy + depth
                num += 1
        unseen, within = -1 if sees_robot[i] else robot, settings.neighbour_distance
        for k in range(_nearest(order, square, position, body, unseen, within, settings.max_neighbours)):
            j = order[k]
            px, py, reach, share = position[j, 0] - x, position[j, 1] - y, radius[j] + r, AMONG_PEOPLE
            qx, qy = vx - velocity[j, 0], vy - velocity[j, 1]
            if j == robot:
                share = settings.robot_share
                reach += min(settings.personal_space, max(np.sqrt(px * px + py * py) - reach, 0.0))
                if at_rest[i]:
                    qx, qy, share = vx, vy, 1.0
            nx, ny, depth = leave_velocity_obstacle(px, py, qx, qy, reach, settings.horizon, settings.period)
            planes[num, 0], planes[num, 1], planes[num, 2] = nx, ny, nx * vx + ny * vy + share * depth
            num += 1
        out[i, 0], out[i, 1], _ = nearest_within(planes, num, hard, no_box, max_speed[i], desired[i, 0], desired[i, 1])
    return out
