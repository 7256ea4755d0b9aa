"""The world as plain kinematics: a unicycle and discs that never overlap. No forces; fast; the paper's own setting."""

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.geometry.compiled import exact
from mjnav.geometry.floor import box_distance
from mjnav.geometry.kernel_types import Indices, Matrix, Vector
from mjnav.messages import Array
from mjnav.motion.diff_drive import LIDAR_HEIGHT, wheel_speeds
from mjnav.scenarios.spec import Scenario
from mjnav.world.engine import ContactLog
from mjnav.world.floor_plan import FloorPlan
from mjnav.world.lidar import beam_angles, cast


class KinematicEngine:
    """An `Engine` without forces.

    In each step people move first, in their order, then the robot. Who would come closer to something than touching
    stays for that step; the robot may still turn. That is a contact where the robot is one of the two.
    """

    def __init__(self, scenario: Scenario, velocities: Array):
        self.contacts = ContactLog()
        self._plan = FloorPlan.of(scenario)
        self._names = tuple(f"person{i}" for i in range(len(scenario.people))) + self._plan.names
        self._timestep = scenario.physics.timestep
        self._steps = 0
        # x, y, yaw with its full turns, left and right wheel angle, v, omega
        self._robot = np.array([*scenario.robot.start, 0.0, 0.0, 0.0, 0.0])
        self._radius = scenario.robot.radius
        # x, y, vx, vy, radius
        self._people = np.zeros((len(scenario.people), 5))
        for row, person in zip(self._people, scenario.people, strict=True):
            row[:2], row[4] = person.start, person.radius
        self._people[:, 2:4] = velocities
        self._desired = np.array(velocities, float).reshape(-1, 2)
        self._first_touch = np.full(len(self._names), -1)

        self._beams = beam_angles(scenario.sensors.lidar_beams)
        self._range = scenario.sensors.lidar_range
        seen = self._plan.disc_heights > LIDAR_HEIGHT
        self._seen_discs = np.concatenate([self._plan.discs[seen], np.zeros((len(self._people), 3))])
        self._seen_boxes = self._plan.boxes[self._plan.box_heights > LIDAR_HEIGHT]

    def advance(self, twists: Array) -> None:
        """See `Engine`."""
        touch = self._first_touch
        touch[:] = -1
        left, right = wheel_speeds(1.0, 0.0)[0], wheel_speeds(0.0, 1.0)[1]
        _advance(
            self._robot,
            self._radius,
            self._people,
            self._desired,
            self._plan.discs,
            self._plan.boxes,
            np.ascontiguousarray(twists),
            self._timestep,
            (left, right),
            touch,
        )
        for i in np.flatnonzero(touch >= 0):
            self.contacts.add(self._names[i], 0.0, (self._steps + int(touch[i])) * self._timestep)
        self._steps += len(twists)

    def walk(self, velocities: Array) -> None:
        """See `Engine`."""
        self._desired[:] = velocities

    def robot_pose(self) -> Array:
        """See `Engine`."""
        return np.array([self._robot[0], self._robot[1], wrap(self._robot[2])])

    def robot_twist(self) -> Array:
        """See `Engine`."""
        return self._robot[5:7].copy()

    def yaw(self) -> float:
        """See `Engine`."""
        return float(self._robot[2])

    def wheel_angles(self) -> tuple[float, float]:
        """See `Engine`."""
        return float(self._robot[3]), float(self._robot[4])

    def people_position(self) -> Array:
        """See `Engine`."""
        return self._people[:, 0:2].copy()

    def people_velocity(self) -> Array:
        """See `Engine`."""
        return self._people[:, 2:4].copy()

    def scan(self) -> Array:
        """See `Engine`."""
        num_fixed = len(self._seen_discs) - len(self._people)
        self._seen_discs[num_fixed:] = self._people[:, [0, 1, 4]]
        return cast(self._robot[:2], self._beams + self._robot[2], self._seen_discs, self._seen_boxes, self._range)

    def state_bytes(self) -> bytes:
        """See `Engine`."""
        return b"".join(a.tobytes() for a in (np.array(self._steps), self._robot, self._people, self._desired))


@exact
def _blocked(x, y, new_x, new_y, radius, discs, boxes, touched, step):
    """Whether moving a disc there would bring it closer to a fixed thing than touching; notes which and when."""
    blocked = False
    for j in range(len(discs)):
        reach = radius + discs[j, 2]
        distance = np.hypot(new_x - discs[j, 0], new_y - discs[j, 1])
        if distance < reach and distance < np.hypot(x - discs[j, 0], y - discs[j, 1]):
            blocked = True
            if touched[j] < 0:
                touched[j] = step
    for j in range(len(boxes)):
        distance = box_distance(new_x, new_y, boxes[j])
        if distance < radius and distance < box_distance(x, y, boxes[j]):
            blocked = True
            if touched[len(discs) + j] < 0:
                touched[len(discs) + j] = step
    return blocked


@exact
def _advance(
    robot: Vector,
    radius: float,
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

    first_touch (P + n + m,) receives the first step in which the robot met each person, disc and box.
    """
    num_people = len(people)
    unnoted = np.zeros(len(discs) + len(boxes), np.int64)
    for step in range(len(twists)):
        for i in range(num_people):
            x, y, reach = people[i, 0], people[i, 1], radius + people[i, 4]
            new_x, new_y = x + desired[i, 0] * timestep, y + desired[i, 1] * timestep
            blocked = _blocked(x, y, new_x, new_y, people[i, 4], discs, boxes, unnoted, step)
            distance = np.hypot(new_x - robot[0], new_y - robot[1])
            if distance < reach and distance < np.hypot(x - robot[0], y - robot[1]):
                blocked = True
                if first_touch[i] < 0:
                    first_touch[i] = step
            if blocked:
                people[i, 2], people[i, 3] = 0.0, 0.0
            else:
                people[i, 0], people[i, 1] = new_x, new_y
                people[i, 2], people[i, 3] = desired[i, 0], desired[i, 1]

        v, omega = twists[step, 0], twists[step, 1]
        x, y, half = robot[0], robot[1], 0.5 * omega * timestep
        # The unicycle's exact arc, as in mjnav.motion.unicycle.
        chord = v * timestep * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
        new_x, new_y = x + chord * np.cos(robot[2] + half), y + chord * np.sin(robot[2] + half)
        blocked = _blocked(x, y, new_x, new_y, radius, discs, boxes, first_touch[num_people:], step)
        for i in range(num_people):
            distance = np.hypot(new_x - people[i, 0], new_y - people[i, 1])
            if distance < radius + people[i, 4] and distance < np.hypot(x - people[i, 0], y - people[i, 1]):
                blocked = True
                if first_touch[i] < 0:
                    first_touch[i] = step
        if blocked:
            v = 0.0
        else:
            robot[0], robot[1] = new_x, new_y
        robot[2] += omega * timestep
        robot[3] += (v * wheel[0] - omega * wheel[1]) * timestep
        robot[4] += (v * wheel[0] + omega * wheel[1]) * timestep
        robot[5], robot[6] = v, omega
