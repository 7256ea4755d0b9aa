"""The kinematic engine: a unicycle and people as discs that never overlap, without forces.

It is fast, and the setting of the paper that `mjnav.paper` measures again. Bodies never come closer to anything than
touching. In each step people move first, in their order, then the robot. A person whose way is blocked slides along
what blocks it, or else stays for that step. A robot whose way is blocked stays, and may still turn, unless it is of
several discs and one of them meets something in turning.
"""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Indices, Matrix, Vector, exact
from mjnav.geometry.angles import wrap
from mjnav.geometry.beams import cast
from mjnav.geometry.distances import placed
from mjnav.geometry.floor import box_distance, surface
from mjnav.messages import Array
from mjnav.scene.spec import Scenario
from mjnav.world.engine import ContactLog
from mjnav.world.floor_plan import FloorPlan

# --------------------------------------------------------------------- one step of people and robot


ROUNDING = 1e-12  # [m] by which a disc may come closer in a step: sliding along a wall keeps the distance but for it
APART = 0.3  # [m/s] at which each of two people who overlap steps away from the other
TRIES = 3  # straight on, and along each of two obstacles
SPARE = 1e-6  # [m] by which `in_reach` looks further than anybody can get


@exact
def in_reach(people, room, discs, boxes):
    """What each person may meet while nobody goes further than their `room` (P,) [m]: rows of (P, P + n + m + 1).

    A row holds indices of people, discs and boxes, counted in this order, ascending, and ends with -1.
    """
    num_people, num_discs = len(people), len(discs)
    found = np.empty((num_people, num_people + num_discs + len(boxes) + 1), np.int64)
    for i in range(num_people):
        x, y, own = people[i, 0], people[i, 1], people[i, 4] + room[i] + SPARE
        count = 0
        for j in range(num_people):
            reach = own + people[j, 4] + room[j]
            if j != i and abs(people[j, 0] - x) < reach and abs(people[j, 1] - y) < reach:
                found[i, count] = j
                count += 1
        for j in range(num_discs):
            reach = own + discs[j, 2]
            if abs(discs[j, 0] - x) < reach and abs(discs[j, 1] - y) < reach:
                found[i, count] = num_people + j
                count += 1
        for j in range(len(boxes)):
            if box_distance(x, y, boxes[j]) < own:
                found[i, count] = num_people + num_discs + j
                count += 1
        found[i, count] = -1
    return found


@exact
def step_people(people, desired, robot, discs, boxes, timestep, nearby, first_touch, step):
    """Moves people (P, 5), x, y, vx, vy, radius, in place; NaN is somebody who is not there.

    `robot` (C, 3) are its discs, `nearby` is what people may meet, of `in_reach`. first_touch (P + ...,) receives
    `step` for each person who met the robot for the first time. Returns whether some overlapped and were moved apart,
    beyond the way that they wanted.
    """
    overlap, num_people = False, len(people)
    for i in range(num_people):
        if np.isnan(people[i, 0]):
            continue
        dx, dy = desired[i, 0] * timestep, desired[i, 1] * timestep
        people[i, 2], people[i, 3] = 0.0, 0.0
        for attempt in range(TRIES):
            nx, ny, robot_met = _obstacle(i, dx, dy, people, robot, discs, boxes, nearby[i])
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
        for j in nearby[i]:
            if j < 0 or j >= i:
                break
            reach, x, y = people[i, 4] + people[j, 4], people[i, 0] - people[j, 0], people[i, 1] - people[j, 1]
            if abs(x) < reach and abs(y) < reach and np.hypot(x, y) < reach - 1e-9:
                overlap = True
    if overlap:
        _step_apart(people, robot, discs, boxes, timestep)
    return overlap


@exact
def _step_apart(people, robot, discs, boxes, timestep):
    """People who overlap, as some do at the start, go apart along the line of centres as far as there is room.

    Each goes half of the overlap, at APART at most. Two at one point go along y, the first of them to the right of x.
    """
    nearby = in_reach(people, np.full(len(people), np.inf), discs, boxes)
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
                nx, ny, _ = _obstacle(who, sign * x, sign * y, people, robot, discs, boxes, nearby[who])
                if nx == 0.0 and ny == 0.0:
                    people[who, 0] += sign * x
                    people[who, 1] += sign * y


@exact
def _obstacle(i, dx, dy, people, robot, discs, boxes, nearby):
    """What of all that is `nearby` person i would come closer to than touching by moving (dx, dy).

    The unit vector towards it, of several towards the one that the person would overlap most; (0, 0) where the way is
    free. And whether the robot is among them.
    """
    x, y, radius = people[i, 0], people[i, 1], people[i, 4]
    nx, ny, deepest, robot_met = 0.0, 0.0, 0.0, False
    num_people, num_discs = len(people), len(discs)
    for place in range(-len(robot), len(nearby)):
        j = place if place < 0 else nearby[place]
        if place >= 0 and j < 0:
            break
        if j >= num_people + num_discs:
            box = j - num_people - num_discs
            missing, before = radius - box_distance(x + dx, y + dy, boxes[box]), box_distance(x, y, boxes[box])
            if missing > deepest and before > radius - missing + ROUNDING:
                _, away_x, away_y = surface(x, y, discs[:0], boxes[box : box + 1])
                nx, ny, deepest = -away_x, -away_y, missing
            continue
        if j < 0:
            cx, cy, reach = robot[j, 0], robot[j, 1], radius + robot[j, 2]
        elif j < num_people:
            cx, cy, reach = people[j, 0], people[j, 1], radius + people[j, 4]
        else:
            k = j - num_people
            cx, cy, reach = discs[k, 0], discs[k, 1], radius + discs[k, 2]
        if not (abs(cx - x - dx) < reach and abs(cy - y - dy) < reach):
            continue
        missing, before = reach - np.hypot(cx - x - dx, cy - y - dy), np.hypot(cx - x, cy - y)
        if missing > 0.0 and before > reach - missing + ROUNDING:
            robot_met = robot_met or j < 0
            if missing > deepest:
                nx, ny, deepest = (cx - x) / before, (cy - y) / before, missing
    return nx, ny, robot_met


@exact
def _stand(body: Matrix, cover: Matrix, x: float, y: float, yaw: float):
    """The robot's discs (C, 3), x, y, radius, of its `cover` (C, 2), how far ahead and radius."""
    for c in range(len(cover)):
        body[c, 0], body[c, 1] = x + cover[c, 0] * np.cos(yaw), y + cover[c, 0] * np.sin(yaw)
        body[c, 2] = cover[c, 1]


@exact
def _meets(body: Matrix, after: Matrix, people: Matrix, discs: Matrix, boxes: Matrix, first_touch: Indices, step: int):
    """Whether a disc of the robot (C, 3) comes closer to what it overlaps `after` a move.

    first_touch (P + n + m,) receives `step` for each person, disc and box that it meets for the first time.
    """
    met = False
    for c in range(len(body)):
        x, y, radius, new_x, new_y = body[c, 0], body[c, 1], body[c, 2], after[c, 0], after[c, 1]
        for j in range(len(people) + len(discs)):
            k = j - len(people)
            cx, cy, other = (
                (people[j, 0], people[j, 1], people[j, 4]) if k < 0 else (discs[k, 0], discs[k, 1], discs[k, 2])
            )
            if not (abs(new_x - cx) < radius + other and abs(new_y - cy) < radius + other):
                continue
            distance = np.hypot(new_x - cx, new_y - cy)
            if distance < radius + other and distance < np.hypot(x - cx, y - cy):
                met = True
                if first_touch[j] < 0:
                    first_touch[j] = step
        for j in range(len(boxes)):
            distance = box_distance(new_x, new_y, boxes[j])
            if distance < radius and distance < box_distance(x, y, boxes[j]):
                met = True
                if first_touch[len(people) + len(discs) + j] < 0:
                    first_touch[len(people) + len(discs) + j] = step
    return met


@exact
def step_robot(
    robot: Vector,
    body: Matrix,
    after: Matrix,
    cover: Matrix,
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

    `body` (C, 3) are its discs before and, when it has moved, after; `after` is memory for as many.
    """
    x, y, half = robot[0], robot[1], 0.5 * omega * timestep
    # The unicycle's exact arc, as in mjnav.motion.unicycle.
    chord = v * timestep * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    new_x, new_y = x + chord * np.cos(robot[2] + half), y + chord * np.sin(robot[2] + half)
    _stand(after, cover, new_x, new_y, robot[2] + omega * timestep)
    if _meets(body, after, people, discs, boxes, first_touch, step):
        v = 0.0
        _stand(after, cover, x, y, robot[2] + omega * timestep)
        if _meets(body, after, people, discs, boxes, first_touch, step):
            omega = 0.0
    else:
        robot[0], robot[1] = new_x, new_y
    robot[2] += omega * timestep
    _stand(body, cover, robot[0], robot[1], robot[2])
    robot[3] += (v * wheel[0] - omega * wheel[1]) * timestep
    robot[4] += (v * wheel[0] + omega * wheel[1]) * timestep
    robot[5], robot[6] = v, omega


# --------------------------------------------------------------------------------------- the engine


class KinematicEngine:
    """An `Engine` without forces; how people and robot move is in `step_people` and `step_robot`.

    Who is blocked by the robot, or blocks it, has touched it.
    """

    def __init__(self, scenario: Scenario, velocities: Array):
        self.contacts = ContactLog()
        self._plan = FloorPlan.of(scenario)
        self._names = tuple(f"person{i}" for i in range(len(scenario.people))) + self._plan.names
        self._timestep = scenario.physics.timestep
        self._steps = 0
        # x, y, yaw with its full turns, left and right wheel angle, v, omega
        self._robot = np.array([*scenario.robot.start, 0.0, 0.0, 0.0, 0.0])
        self._jump = 0.0  # [rad] of the heading, by teleporting
        self._spun = np.zeros(2)  # [rad] that the wheels turned on the spot
        self._cover, drive = np.array(scenario.robot.limits.discs), scenario.robot.drive
        self._wheel = drive.wheel_speeds(1.0, 0.0)[0], drive.wheel_speeds(0.0, 1.0)[1]  # [rad/s] per v, per omega
        # x, y, vx, vy, radius
        self._people = np.zeros((len(scenario.people), 5))
        for row, person in zip(self._people, scenario.people, strict=True):
            row[:2], row[4] = person.start, person.radius
        self._people[:, 2:4] = velocities
        self._desired = np.array(velocities, float).reshape(-1, 2)
        self._first_touch = np.full(len(self._names), -1)

        height = scenario.sensors.scanner.height
        seen = self._plan.disc_heights > height
        self._seen_discs = np.concatenate([self._plan.discs[seen], np.zeros((len(self._people), 3))])
        self._seen_boxes = self._plan.boxes[self._plan.box_heights > height]

    def advance(self, twists: Array) -> None:
        """See `Engine`."""
        touch = self._first_touch
        touch[:] = -1
        touched = _advance(
            self._robot,
            self._cover,
            self._people,
            self._desired,
            self._plan.discs,
            self._plan.boxes,
            np.ascontiguousarray(twists),
            self._timestep,
            self._wheel,
            touch,
        )
        for i in np.flatnonzero(touch >= 0) if touched else ():
            self.contacts.add(self._names[i], 0.0, (self._steps + int(touch[i])) * self._timestep)
        self._steps += len(twists)

    def walk(self, velocities: Array) -> None:
        """See `Engine`."""
        self._desired[:] = velocities

    def place(self, person: int, position: ArrayLike, velocity: ArrayLike) -> None:
        """See `Engine`."""
        self._people[person, :2], self._people[person, 2:4] = position, velocity

    def remove(self, person: int) -> None:
        """See `Engine`."""
        self._people[person, :4] = np.nan

    def teleport(self, pose: Array) -> None:
        """See `Engine`."""
        self._jump += pose[2] - self._robot[2]
        self._robot[:3] = pose

    def spin(self, angles: Array) -> None:
        """See `Engine`."""
        for row in angles:  # row by row, so that the bits do not depend on where a call ends
            self._spun += row

    def robot_pose(self) -> Array:
        """See `Engine`."""
        return np.array([self._robot[0], self._robot[1], wrap(self._robot[2])])

    def robot_twist(self) -> Array:
        """See `Engine`."""
        return self._robot[5:7].copy()

    def yaw(self) -> float:
        """See `Engine`."""
        return float(self._robot[2] - self._jump)

    def wheel_angles(self) -> tuple[float, float]:
        """See `Engine`."""
        return float(self._robot[3] + self._spun[0]), float(self._robot[4] + self._spun[1])

    def people_position(self) -> Array:
        """See `Engine`."""
        return self._people[:, 0:2].copy()

    def people_velocity(self) -> Array:
        """See `Engine`."""
        return self._people[:, 2:4].copy()

    def cast(self, mount: Array, angles: Array, max_range: float) -> Array:
        """See `Engine`."""
        num_fixed = len(self._seen_discs) - len(self._people)
        self._seen_discs[num_fixed:] = self._people[:, [0, 1, 4]]
        pose = placed(self._robot[:3], mount)
        return cast(pose[:2], angles + pose[2], self._seen_discs, self._seen_boxes, max_range)

    def state_bytes(self) -> bytes:
        """See `Engine`."""
        state = [np.array(self._steps), self._robot, self._people, self._desired]
        if self._jump or self._spun.any():
            state += [np.array(self._jump), self._spun]
        return b"".join(a.tobytes() for a in state)


@exact
def _advance(
    robot: Vector,
    cover: Matrix,
    people: Matrix,
    desired: Matrix,
    discs: Matrix,
    boxes: Matrix,
    twists: Matrix,
    timestep: float,
    wheel: tuple[float, float],
    first_touch: Indices,
):
    """Steps everything in place, one step a row of `twists`; `wheel` is wheel speed per v and per omega.

    first_touch (P + n + m,) receives the first step in which the robot met each person, disc and box. Returns whether
    it met any.
    """
    room = len(twists) * timestep * np.hypot(desired[:, 0], desired[:, 1])
    nearby = in_reach(people, room, discs, boxes)
    body, after = np.empty((len(cover), 3)), np.empty((len(cover), 3))
    _stand(body, cover, robot[0], robot[1], robot[2])
    for step in range(len(twists)):
        if step_people(people, desired, body, discs, boxes, timestep, nearby, first_touch, step):
            nearby = in_reach(people, room, discs, boxes)
        v, omega = twists[step, 0], twists[step, 1]
        step_robot(
            robot, body, after, cover, people, discs, boxes, v, omega, timestep, wheel, first_touch, step
        )  # fmt: skip
    return (first_touch >= 0).any()
