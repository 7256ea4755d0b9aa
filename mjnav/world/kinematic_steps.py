"""One step of people and robot as discs that never come closer to anything than touching.

In each step people move first, in their order, then the robot. A person whose way is blocked slides along what blocks
it, or else stays for that step; the robot stays, and may still turn.
"""

import numpy as np

from mjnav.geometry.compiled import exact
from mjnav.geometry.floor import box_distance, surface
from mjnav.geometry.kernel_types import Indices, Matrix, Vector

ROUNDING = 1e-12  # [m] by which a disc may come closer in a step: sliding along a wall keeps the distance but for it
APART = 0.3  # [m/s] at which each of two people who overlap steps away from the other
TRIES = 3  # straight on, and along each of two obstacles


@exact
def step_people(
    people: Matrix,
    desired: Matrix,
    robot: Vector,
    robot_radius: float,
    discs: Matrix,
    boxes: Matrix,
    timestep: float,
    first_touch: Indices,
    step: int,
):
    """Moves people (P, 5), x, y, vx, vy, radius, in place; NaN is somebody who is not there.

    first_touch (P + ...,) receives `step` for each person who met the robot for the first time.
    """
    overlap = False
    for i in range(len(people)):
        if np.isnan(people[i, 0]):
            continue
        dx, dy = desired[i, 0] * timestep, desired[i, 1] * timestep
        people[i, 2], people[i, 3] = 0.0, 0.0
        for attempt in range(TRIES):
            nx, ny, robot_met = _obstacle(i, dx, dy, people, robot, robot_radius, discs, boxes)
            if robot_met and first_touch[i] < 0:
                first_touch[i] = step
            if nx == 0.0 and ny == 0.0:
                people[i, 0] += dx
                people[i, 1] += dy
                people[i, 2] = desired[i, 0] if attempt == 0 else dx / timestep
                people[i, 3] = desired[i, 1] if attempt == 0 else dy / timestep
                break
            inward = dx * nx + dy * ny
            dx -= inward * nx
            dy -= inward * ny
        for j in range(i):
            reach = people[i, 4] + people[j, 4]
            if np.hypot(people[i, 0] - people[j, 0], people[i, 1] - people[j, 1]) < reach - 1e-9:
                overlap = True
    if overlap:
        _step_apart(people, robot, robot_radius, discs, boxes, timestep)


@exact
def _step_apart(people: Matrix, robot: Vector, robot_radius: float, discs: Matrix, boxes: Matrix, timestep: float):
    """People who overlap, as some do at the start, go apart along the line of centres as far as there is room.

    Each goes half of the overlap, at APART at most. Two at one point go along y, the first of them to the right of x.
    """
    for i in range(len(people)):
        for j in range(i):
            x, y = people[i, 0] - people[j, 0], people[i, 1] - people[j, 1]
            distance = np.hypot(x, y)
            missing = people[i, 4] + people[j, 4] - distance
            if not missing > 0.0:
                continue
            x, y = (x / distance, y / distance) if distance > 0.0 else (0.0, 1.0)
            share = min(0.5 * missing, APART * timestep)
            for who, sign in ((i, share), (j, -share)):
                nx, ny, _ = _obstacle(who, sign * x, sign * y, people, robot, robot_radius, discs, boxes)
                if nx == 0.0 and ny == 0.0:
                    people[who, 0] += sign * x
                    people[who, 1] += sign * y


@exact
def _obstacle(
    i: int, dx: float, dy: float, people: Matrix, robot: Vector, robot_radius: float, discs: Matrix, boxes: Matrix
):
    """What person i would come closer to than touching by moving (dx, dy): the unit vector towards it, of several the
    one that the person would overlap most; (0, 0) where the way is free. And whether the robot is among them.
    """
    x, y, radius = people[i, 0], people[i, 1], people[i, 4]
    nx, ny, deepest, robot_met = 0.0, 0.0, 0.0, False
    for j in range(-1, len(people) + len(discs)):
        if j < 0:
            cx, cy, reach = robot[0], robot[1], radius + robot_radius
        elif j < len(people):
            cx, cy, reach = people[j, 0], people[j, 1], radius + people[j, 4]
        else:
            k = j - len(people)
            cx, cy, reach = discs[k, 0], discs[k, 1], radius + discs[k, 2]
        if j == i or not (abs(cx - x - dx) < reach and abs(cy - y - dy) < reach):
            continue
        missing, before = reach - np.hypot(cx - x - dx, cy - y - dy), np.hypot(cx - x, cy - y)
        if missing > 0.0 and before > reach - missing + ROUNDING:
            robot_met = robot_met or j < 0
            if missing > deepest:
                nx, ny, deepest = (cx - x) / before, (cy - y) / before, missing
    for j in range(len(boxes)):
        missing, before = radius - box_distance(x + dx, y + dy, boxes[j]), box_distance(x, y, boxes[j])
        if missing > deepest and before > radius - missing + ROUNDING:
            _, away_x, away_y = surface(x, y, discs[:0], boxes[j : j + 1])
            nx, ny, deepest = -away_x, -away_y, missing
    return nx, ny, robot_met


@exact
def step_robot(
    robot: Vector,
    radius: float,
    people: Matrix,
    discs: Matrix,
    boxes: Matrix,
    v: float,
    omega: float,
    timestep: float,
    wheel: tuple[float, float],
    first_touch: Indices,
    step: int,
):
    """Moves the robot (7,), x, y, yaw, wheel angles, v, omega, in place; `wheel` is wheel speed per v and per omega.

    first_touch (P + n + m,) receives `step` for each person, disc and box that it meets for the first time.
    """
    x, y, half = robot[0], robot[1], 0.5 * omega * timestep
    # The unicycle's exact arc, as in mjnav.motion.unicycle.
    chord = v * timestep * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    new_x, new_y = x + chord * np.cos(robot[2] + half), y + chord * np.sin(robot[2] + half)
    blocked = False
    for j in range(len(people) + len(discs)):
        k = j - len(people)
        cx, cy, other = (people[j, 0], people[j, 1], people[j, 4]) if k < 0 else (discs[k, 0], discs[k, 1], discs[k, 2])
        distance = np.hypot(new_x - cx, new_y - cy)
        if distance < radius + other and distance < np.hypot(x - cx, y - cy):
            blocked = True
            if first_touch[j] < 0:
                first_touch[j] = step
    for j in range(len(boxes)):
        distance = box_distance(new_x, new_y, boxes[j])
        if distance < radius and distance < box_distance(x, y, boxes[j]):
            blocked = True
            if first_touch[len(people) + len(discs) + j] < 0:
                first_touch[len(people) + len(discs) + j] = step
    if blocked:
        v = 0.0
    else:
        robot[0], robot[1] = new_x, new_y
    robot[2] += omega * timestep
    robot[3] += (v * wheel[0] - omega * wheel[1]) * timestep
    robot[4] += (v * wheel[0] + omega * wheel[1]) * timestep
    robot[5], robot[6] = v, omega
