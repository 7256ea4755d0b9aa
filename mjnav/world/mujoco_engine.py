"""The MuJoCo engine: the robot's wheels push it, people have 70 kg, and contacts have forces.

Each person has two slide joints behind a velocity servo.

Between samples of the state nothing calls `mj_forward`: poses and velocities are read from qpos and qvel, which are
current, where derived fields lag one step; so looking does not change the run.
"""

# pyright: reportAttributeAccessIssue=false
# mujoco's compiled modules carry no types.

from collections.abc import Sequence
from copy import copy, deepcopy
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, Vector, exact
from mjnav.geometry.distances import placed
from mjnav.messages import Array
from mjnav.scene.ranges import MAX_LENGTH
from mjnav.scene.spec import Scenario
from mjnav.world.engine import ContactLog, DivergedError
from mjnav.world.floor_plan import FloorPlan
from mjnav.world.scene import SEEN_BY_LIDAR, WALLS, compiled

# ------------------------------------------------------------------------------------------- people


ACCELERATION = 6.0  # [m/s^2] more than 250 N on each of two axes give 70 kg, 5.05
OVERLAP = 0.02  # [m] that two people who press against each other may overlap, and more
APART_SPEED = 0.3  # [m/s] beyond their own of people who overlap at the start: contact forces would throw them apart
# Where people are who are not there: beyond the lidar of a robot at the edge of the largest scene, in a row.
AWAY, AWAY_STEP = 3.0 * MAX_LENGTH, 5.0  # [m]


class MujocoPeople:
    """Where people are and how they walk, by views of MuJoCo's state."""

    def __init__(self, model: "mujoco.MjModel", data: "mujoco.MjData", scenario: Scenario, velocities: Array):
        axes = [f"person{i}/{axis}" for i in range(len(scenario.people)) for axis in "xy"]
        self._joints = _stretch([model.joint(name).qposadr[0] for name in axes])
        self._dofs = _stretch([model.joint(name).dofadr[0] for name in axes])
        self._servos = _stretch([model.actuator(name).id for name in axes])
        self._start = np.array([person.start for person in scenario.people], float).reshape(-1, 2)
        self._radii = np.array([person.radius for person in scenario.people], float)
        self._present, self._all_present = np.ones(len(scenario.people), bool), True
        self._bind(data)
        self._velocities[:] = velocities
        # Some may overlap at the start, and never again: newcomers wait for a free place.
        self.overlap = bool(_overlapping(self._start, self._radii).any())

    def bound(self, data: "mujoco.MjData") -> "MujocoPeople":
        """The same people in another state of the same model."""
        twin = copy(self)
        twin._present = self._present.copy()
        twin._bind(data)
        return twin

    def _bind(self, data: "mujoco.MjData") -> None:
        self._moves = data.qpos[self._joints].reshape(-1, 2)  # [m] since the start
        self._velocities = data.qvel[self._dofs].reshape(-1, 2)  # [m/s]
        self._desired = data.ctrl[self._servos].reshape(-1, 2)  # [m/s]

    def __len__(self) -> int:
        return len(self._radii)

    def walk(self, velocities: Array) -> None:
        """See `Engine`."""
        self._desired[:] = velocities

    def place(self, person: int, position: ArrayLike, velocity: ArrayLike) -> None:
        """See `Engine`."""
        self._moves[person] = np.asarray(position, float) - self._start[person]
        self._velocities[person] = velocity
        self._present[person] = True
        self._all_present = bool(self._present.all())

    def remove(self, person: int) -> None:
        """See `Engine`."""
        self.place(person, (AWAY, AWAY + AWAY_STEP * person), (0.0, 0.0))
        self._desired[person] = 0.0
        self._present[person] = self._all_present = False

    def position(self) -> Array:
        """See `Engine`."""
        return self._of_present(self._start + self._moves)

    def velocity(self) -> Array:
        """See `Engine`."""
        return self._of_present(self._velocities.copy())

    def _of_present(self, values: Array) -> Array:
        if not self._all_present:
            values[~self._present] = np.nan
        return values

    def nearest(self, x: float, y: float, radius: float) -> tuple[float, float, float]:
        """Clearance [m] from a disc to the nearest person, and bounds of any person's speed and acceleration.

        Of P people who push one another, one may take over the kinetic energy of all and be pushed by the forces of
        all: sqrt(P) times the fastest one's speed and P times the acceleration.
        """
        clearance, fastest = _nearest(x, y, self._start + self._moves, self._velocities, self._radii + radius)
        return clearance, fastest * sqrt(len(self)), ACCELERATION * len(self)

    def part(self, timestep: float) -> None:
        """Slows those who overlap, in the step that was made last; once nobody does, `overlap` is over for good."""
        overlapping = _overlapping(self._start + self._moves, self._radii)
        self.overlap = bool(overlapping.any())
        for i in np.flatnonzero(overlapping).tolist():
            speed, limit = np.hypot(*self._velocities[i]), np.hypot(*self._desired[i]) + APART_SPEED
            if speed > limit:
                self._moves[i] -= (1.0 - limit / speed) * timestep * self._velocities[i]
                self._velocities[i] *= limit / speed


def _stretch(places: Sequence[int]) -> slice:
    """The slice of these places, which follow one another as people do in the model: a slice is a view."""
    if not len(places):
        return slice(0, 0)
    assert np.all(np.diff(places) == 1), "people's joints and servos follow one another"
    return slice(int(places[0]), int(places[-1]) + 1)


@exact
def _overlapping(positions: Matrix, radii: Vector):
    """(P,) who overlaps with somebody by more than OVERLAP."""
    found = np.zeros(len(radii), np.bool_)
    for i in range(len(radii)):
        for j in range(i):
            distance = np.hypot(positions[i, 0] - positions[j, 0], positions[i, 1] - positions[j, 1])
            if distance < radii[i] + radii[j] - OVERLAP:
                found[i] = found[j] = True
    return found


@exact
def _nearest(x: float, y: float, positions: Matrix, velocities: Matrix, reach: Vector):
    """Clearance [m] of the person nearest to touching, and the fastest one's speed [m/s]."""
    clearance, fastest = np.inf, 0.0
    for i in range(len(reach)):
        clearance = min(clearance, np.hypot(positions[i, 0] - x, positions[i, 1] - y) - reach[i])
        fastest = max(fastest, np.hypot(velocities[i, 0], velocities[i, 1]))
    return clearance, fastest


# --------------------------------------------------------------------------------------- the engine


ROBOT_ACCELERATION = 15.0  # [m/s^2] more than tyres of friction 0.9 can give, 8.8
NEAR = 0.01  # [m] for the chassis' lean
_NOBODY, _ROBOT = -2, -1  # geoms' owners; others are indices of bodies' names


class MujocoEngine:
    """An `Engine` on MuJoCo."""

    def __init__(self, scenario: Scenario, velocities: Array):
        self.model = model = compiled(scenario)
        self.contacts = ContactLog()
        self._free = int(model.joint("robot/free").qposadr[0]), int(model.joint("robot/free").dofadr[0])
        self._bind(mujoco.MjData(self.model))
        self._drive, base = scenario.robot.drive, scenario.robot.base
        sides = (("left_wheel",), ("right_wheel",)) if base is None else (base.left_wheels, base.right_wheels)
        joints = [[model.joint(f"robot/{name}") for name in side] for side in sides]
        self._wheels = [int(side[0].qposadr[0]) for side in joints]
        driven = model.actuator_trnid[:, 0].tolist()
        motors = [[driven.index(joint.id) for joint in side] for side in joints]
        self._motors = [side[0] if len(side) == 1 else side for side in motors]
        self._people = MujocoPeople(model, self.data, scenario, velocities)

        self._plan = FloorPlan.of(scenario)
        self._lidar_height = scenario.sensors.scanner.height
        self._radius = scenario.robot.radius
        self._steps = 0
        self._timestep: float = model.opt.timestep
        self._untouched = 0.0  # [s] of simulated time until which nothing can reach the robot
        self._owners, self._names = self._geom_owners()
        self._force = np.zeros(6)

        self._seen = np.zeros(mujoco.mjNGROUP, np.uint8)
        self._seen[SEEN_BY_LIDAR] = 1
        self._heading = self._yaw_angle()
        self._turns = 0
        self._jump = 0.0  # [rad] of the heading, by teleporting
        self._spun = np.zeros(2)  # [rad] that the wheels turned on the spot

    def _bind(self, data: "mujoco.MjData") -> None:
        """Makes `data` the state, by views of it."""
        self.data = data
        self._qpos, self._qvel, self._ctrl = data.qpos, data.qvel, data.ctrl
        pose, velocity = self._free
        self._pose, self._velocity = self._qpos[pose : pose + 7], self._qvel[velocity : velocity + 6]
        self._warnings = data.warning.number  # how often MuJoCo complained, by kind

    def __deepcopy__(self, memo: dict[int, Any]) -> "MujocoEngine":
        """The same state, to the last bit; the model is shared."""
        twin = copy(self)
        twin._bind(copy(self.data))
        twin._people = self._people.bound(twin.data)
        twin.contacts = deepcopy(self.contacts, memo)
        twin._force, twin._spun = self._force.copy(), self._spun.copy()  # written to
        return twin

    def _geom_owners(self) -> tuple[Array, list[str]]:
        """For each geom the index into the bodies' names, or who else owns it."""
        owners, names = np.full(self.model.ngeom, _NOBODY), dict[str, int]()
        for i in range(self.model.ngeom):
            body = self.model.body(int(self.model.geom_bodyid[i])).name
            name, _, inner = (self.model.geom(i).name if body == WALLS else body).partition("/")
            if name == "robot":
                owners[i] = _ROBOT
            elif inner:
                owners[i] = names.setdefault(name, len(names))
        return owners, list(names)

    # ------------------------------------------------------------------------------------- motion

    def advance(self, twists: Array) -> None:
        """See `Engine`."""
        model, data, ctrl = self.model, self.data, self._ctrl
        (left, right), timestep, num_steps = self._motors, self._timestep, len(twists)
        wheels = self._drive.wheel_speeds(twists[:, 0], twists[:, 1])
        speeds = list(zip(*(side.tolist() for side in wheels), strict=True))
        near, people = not self._is_untouched(num_steps * timestep), self._people
        told = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(lambda text: None)  # else it goes to standard error and to a file MUJOCO_LOG.TXT
        try:
            if not near and not people.overlap and speeds.count(speeds[0]) == num_steps:
                ctrl[left], ctrl[right] = speeds[0]
                mujoco.mj_step(model, data, num_steps)
            else:
                for i, speed in enumerate(speeds):
                    ctrl[left], ctrl[right] = speed
                    mujoco.mj_step(model, data)
                    if near:
                        self._record_contacts((self._steps + i) * timestep)
                    if people.overlap:
                        people.part(self._timestep)
        finally:
            mujoco.set_mju_user_warning(told)
        if any(self._warnings.tolist()):
            raise DivergedError(self._complaint())
        self._steps += num_steps
        heading = self._yaw_angle()
        if abs(heading - self._heading) > pi:
            self._turns += 1 if heading < self._heading else -1
        self._heading = heading

    def _complaint(self) -> str:
        kind = int(np.flatnonzero(self._warnings)[-1])  # a state that is out of bounds comes after what led to it
        text = mujoco.mju_warningText(kind, self.data.warning[kind].lastinfo)
        return f"MuJoCo lost the physics before {self._steps * self._timestep:.3f} s: {text.strip()}"

    def walk(self, velocities: Array) -> None:
        """See `Engine`."""
        self._people.walk(velocities)

    def place(self, person: int, position: ArrayLike, velocity: ArrayLike) -> None:
        """See `Engine`."""
        self._people.place(person, position, velocity)
        self._untouched = 0.0

    def remove(self, person: int) -> None:
        """See `Engine`."""
        self._people.remove(person)

    def teleport(self, pose: Array) -> None:
        """See `Engine`; the body keeps its height and its lean."""
        x, y, heading = pose.tolist()
        turn = heading - self._heading
        c, s, half_c, half_s = cos(turn), sin(turn), cos(0.5 * turn), sin(0.5 * turn)
        w, i, j, k = self._pose[3:].tolist()
        self._pose[:2] = x, y
        self._pose[3:] = (  # (half_c, 0, 0, half_s) times what it was
            half_c * w - half_s * k,
            half_c * i - half_s * j,
            half_c * j + half_s * i,
            half_c * k + half_s * w,
        )
        vx, vy = self._velocity[:2].tolist()  # in the world; the turn rates are in the body
        self._velocity[:2] = c * vx - s * vy, s * vx + c * vy
        before = self._heading + 2.0 * pi * self._turns
        self._heading, self._turns = self._yaw_angle(), 0
        self._jump += self._heading - before
        self._untouched = 0.0

    def spin(self, angles: Array) -> None:
        """See `Engine`."""
        for row in angles:  # row by row, so that the bits do not depend on where a call ends
            self._spun += row

    def _is_untouched(self, duration: float) -> bool:
        """Whether nothing can touch the robot for `duration` [s]: then steps need not be looked at one by one.

        With clearance c and closing speed s, the earliest touch is where s t + a t^2 / 2 = c.
        """
        now = self._steps * self._timestep
        if now + duration <= self._untouched:
            return True
        x, y = self._pose[:2].tolist()
        vx, vy = self._velocity[:2].tolist()
        speed = hypot(vx, vy)
        earliest = _time_to_touch(self._plan.distance(x, y) - self._radius - NEAR, speed, ROBOT_ACCELERATION)
        if len(self._people):
            clearance, walking, acceleration = self._people.nearest(x, y, self._radius)
            acceleration += ROBOT_ACCELERATION
            earliest = min(earliest, _time_to_touch(clearance - NEAR, speed + walking, acceleration))
        self._untouched = now + earliest
        return duration <= earliest

    def _record_contacts(self, time: float) -> None:
        owners = self._owners[self.data.contact.geom]  # (ncon, 2)
        if not ((owners == _ROBOT) & (owners[:, ::-1] >= 0)).any():
            return
        for i, pair in enumerate(owners.tolist()):
            if min(pair) == _ROBOT and max(pair) >= 0:
                mujoco.mj_contactForce(self.model, self.data, i, self._force)
                self.contacts.add(self._names[max(pair)], float(self._force[0]), time)

    # ------------------------------------------------------------------------------------ reading

    def _yaw_angle(self) -> float:
        _, _, _, w, x, y, z = self._pose.tolist()
        return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))

    def robot_pose(self) -> Array:
        """See `Engine`."""
        return np.array([self._pose[0], self._pose[1], self._heading])

    def robot_twist(self) -> Array:
        """See `Engine`."""
        vx, vy, _, _, _, omega = self._velocity.tolist()
        return np.array([vx * cos(self._heading) + vy * sin(self._heading), omega])

    def yaw(self) -> float:
        """See `Engine`."""
        return self._heading + 2.0 * pi * self._turns - self._jump

    def wheel_angles(self) -> tuple[float, float]:
        """See `Engine`."""
        left, right = (self._qpos[wheel] + spun for wheel, spun in zip(self._wheels, self._spun, strict=True))
        return float(left), float(right)

    def people_position(self) -> Array:
        """See `Engine`."""
        return self._people.position()

    def people_velocity(self) -> Array:
        """See `Engine`."""
        return self._people.velocity()

    def cast(self, mount: Array, angles: Array, max_range: float) -> Array:
        """See `Engine`."""
        model, data, num_beams = self.model, self.data, len(angles)
        mujoco.mj_kinematics(model, data)
        x, y, heading = placed(np.array([self._pose[0], self._pose[1], self._heading]), mount)
        rays, ranges = np.zeros((num_beams, 3)), np.zeros(num_beams)
        rays[:, 0], rays[:, 1] = np.cos(angles + heading), np.sin(angles + heading)
        mujoco.mj_multiRay(
            model, data, np.array([x, y, self._lidar_height]), rays.reshape(-1), self._seen, True, -1,
            np.zeros(num_beams, np.int32), ranges, None, num_beams, max_range,
        )  # fmt: skip
        return np.where((ranges < 0.0) | (ranges > max_range), np.inf, ranges)

    def state_bytes(self) -> bytes:
        """See `Engine`."""
        state = np.zeros(mujoco.mj_stateSize(self.model, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_getState(self.model, self.data, state, mujoco.mjtState.mjSTATE_INTEGRATION)
        turned = np.append(self._spun, self._jump).tobytes() if self._jump or self._spun.any() else b""
        return state.tobytes() + turned


def _time_to_touch(clearance: float, speed: float, acceleration: float) -> float:
    if clearance <= 0.0:
        return 0.0
    if clearance == np.inf:
        return np.inf
    return (sqrt(speed * speed + 2.0 * acceleration * clearance) - speed) / acceleration
