"""The world as plain kinematics: a unicycle and discs that never overlap. No forces; fast; the paper's own setting."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.geometry.angles import wrap
from mjnav.geometry.beams import placed
from mjnav.geometry.compiled import exact
from mjnav.geometry.kernel_types import Indices, Matrix, Vector
from mjnav.messages import Array
from mjnav.motion.diff_drive import LIDAR_HEIGHT, wheel_speeds
from mjnav.scenarios.spec import Scenario
from mjnav.world.engine import ContactLog
from mjnav.world.floor_plan import FloorPlan
from mjnav.world.kinematic_steps import in_reach, step_people, step_robot
from mjnav.world.lidar.casting import cast


class KinematicEngine:
    """An `Engine` without forces; how robot and people move is in `kinematic_steps`.

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
        self._radius = scenario.robot.radius
        # x, y, vx, vy, radius
        self._people = np.zeros((len(scenario.people), 5))
        for row, person in zip(self._people, scenario.people, strict=True):
            row[:2], row[4] = person.start, person.radius
        self._people[:, 2:4] = velocities
        self._desired = np.array(velocities, float).reshape(-1, 2)
        self._first_touch = np.full(len(self._names), -1)

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
    room = len(twists) * timestep * np.hypot(desired[:, 0], desired[:, 1])
    nearby = in_reach(people, room, discs, boxes)
    for step in range(len(twists)):
        if step_people(people, desired, robot, radius, discs, boxes, timestep, nearby, first_touch, step):
            nearby = in_reach(people, room, discs, boxes)
        v, omega = twists[step, 0], twists[step, 1]
        step_robot(robot, radius, people, discs, boxes, v, omega, timestep, wheel, first_touch, step)
