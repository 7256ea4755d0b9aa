"""Faults in the world: of sensor messages and wheel commands, slipping wheels, and kidnappings of the robot.

A `FaultyChannel` carries the messages of one sensor, or the commands to the wheels. A kidnapping puts the robot
elsewhere, wherever it is and whatever it does. `FaultyWheels` changes commands on their way to the wheels, and lets
wheels slip. `FaultySensors` has the faults of all sensors, between the measurement and the robot.
"""

from collections import deque
from dataclasses import dataclass, replace
from math import hypot, sqrt
from typing import Any

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Reading
from mjnav.motion.unicycle import integrate
from mjnav.rng import stream
from mjnav.scene.faults import Blocked, ChannelFaults, Faults, Slip, WheelFaults
from mjnav.scene.spec import Scenario
from mjnav.world.draws import NEVER, Grid
from mjnav.world.engine import Engine

# ---------------------------------------------------------------- a channel of messages or commands


@dataclass(frozen=True, slots=True)
class Message:
    """What one message says, as rows of values that belong together: beams, people, or one row for all."""

    time: float  # [s] at which it was measured
    rows: Array  # (n, c)
    times: Array  # (n,) [s] of each row, where they have their own; else (0,)


class FaultyChannel:
    """The way of a channel's messages from the sensor to whoever hears them.

    On the way come, in this order: bias walk, outliers, stuck, NaN, late, repeated, dropout. Each kind draws from its
    own stream, "fault.<channel>.<kind>", as often whether it lasts or not, and whether there is a message or not.
    """

    def __init__(self, channel: str, faults: ChannelFaults, shape: tuple[int, int], seed: int):
        """`shape` is that of a message's rows."""
        self._faults, self._shape = faults, shape
        kinds = ("bias_walk", "outliers", "nan", "repeated", "dropout")
        self._streams = {k: stream(seed, f"fault.{channel}.{k}") for k in kinds if getattr(faults, k) is not None}
        self._bias = np.zeros(shape[1])
        self._walked = 0.0  # [s] until when the bias has walked
        self._measured: Array | None = None  # the rows of the latest message that was not stuck
        self._arriving: deque[Message] = deque()
        self._heard: Message | None = None

    def pass_on(self, time: float, message: Message | None) -> Message | None:
        """What is heard at `time` [s], where `message` was measured; None where nothing is."""
        message = self._repeated(time, self._late(time, self._with_nan(time, self._distorted(time, message))))
        lost = self._happens("dropout", time)
        if message is None or lost:
            return None
        self._heard = message
        return message

    def _distorted(self, time: float, message: Message | None) -> Message | None:
        error = self._walk(time) + self._outliers(time)
        if message is None:
            return None
        rows = message.rows + error if np.any(error) else message.rows
        if self._faults.stuck is not None:
            if self._faults.stuck.lasts(time) and self._measured is not None:
                rows = self._measured
            self._measured = rows
        return replace(message, rows=rows)

    def _walk(self, time: float) -> Array:
        """The bias of all rows, (c,)."""
        fault = self._faults.bias_walk
        if fault is None:
            return np.zeros(self._shape[1])
        step = self._streams["bias_walk"].standard_normal(self._shape[1])
        if not fault.lasts(time):
            return np.zeros(self._shape[1])
        self._bias = self._bias + fault.size * sqrt(max(time - max(self._walked, fault.start), 0.0)) * step
        self._walked = time
        return self._bias

    def _outliers(self, time: float) -> Array:
        """What rows are off by, (n, c), or (c,) zeros."""
        fault = self._faults.outliers
        if fault is None:
            return np.zeros(self._shape[1])
        draws = self._streams["outliers"].random((self._shape[0], 1 + self._shape[1]))
        if not fault.lasts(time):
            return np.zeros(self._shape[1])
        off = np.where(draws[:, 1:] < 0.5, -fault.size, fault.size)
        return np.where(draws[:, :1] < fault.share, off, 0.0)

    def _with_nan(self, time: float, message: Message | None) -> Message | None:
        if not self._happens("nan", time) or message is None:
            return message
        rows = message.rows.copy()
        rows[:, 0] = np.nan  # of detections x alone: a row of NaN says that nobody is there
        return replace(message, rows=rows)

    def _late(self, time: float, message: Message | None) -> Message | None:
        fault = self._faults.late
        if fault is None:
            return message
        if not fault.lasts(time):
            self._arriving.clear()
            return message
        if message is not None:
            self._arriving.append(message)
        arrived = None
        while self._arriving and self._arriving[0].time + fault.delay <= time + 1e-9:
            arrived = self._arriving.popleft()
        return arrived

    def _repeated(self, time: float, message: Message | None) -> Message | None:
        again = self._happens("repeated", time)
        return self._heard if again and message is not None and self._heard is not None else message

    def _happens(self, kind: str, time: float) -> bool:
        """Whether a fault that has a share strikes now; one draw in any case."""
        fault = getattr(self._faults, kind)
        if fault is None:
            return False
        draw = self._streams[kind].random()
        return fault.lasts(time) and draw < fault.share


# -------------------------------------------------------------------------------------- kidnappings


ROOM = 0.02  # [m] between the robot and the people where it is put down


class Kidnappings:
    """The kidnappings of a run that are still to come."""

    def __init__(self, scenario: Scenario):
        given = () if scenario.faults is None else scenario.faults.kidnappings
        timestep = scenario.physics.timestep
        self._waiting = [(round(one.time / timestep), np.array(one.pose)) for one in given]
        self._reach = np.array([person.radius for person in scenario.people]) + scenario.robot.radius + ROOM
        self.next = self._waiting[0][0] if self._waiting else NEVER  # step

    def pass_moment(self, step: int, engine: Engine) -> None:
        """Puts the robot elsewhere where that is due, or with the next step where somebody stands there."""
        while self._waiting and step >= self._waiting[0][0]:
            pose = self._waiting[0][1]
            if self._taken(pose, engine.people_position()):
                self.next = step + 1
                return
            engine.teleport(pose)
            del self._waiting[0]
            self.next = self._waiting[0][0] if self._waiting else NEVER

    def _taken(self, pose: Array, people: Array) -> bool:
        return any(hypot(x - pose[0], y - pose[1]) < reach for (x, y), reach in zip(people, self._reach, strict=True))


# ------------------------------------------------------------------------------------------- wheels


WATCHDOG = 0.5  # [s] without a command after which the base stops by itself, as bases do


NO_SLIP = np.zeros((0, 2))


class FaultyWheels:
    """Between the commands and the floor. Without faults of the wheels commands and set-points stay as they are."""

    def __init__(self, scenario: Scenario, seed: int):
        faults = WheelFaults() if scenario.faults is None else scenario.faults.wheels or WheelFaults()
        self._timestep = scenario.physics.timestep
        self._slip: Slip | None = faults.slip
        self._drive = scenario.robot.drive
        spoilt = any(kind != "slip" for channel, kind, _ in _each(scenario) if channel == "wheels")
        self._channel = FaultyChannel("wheels", faults, (1, 2), seed) if spoilt else None
        self._sending = Grid(scenario.control.period, self._timestep)
        self._command = (0.0, 0.0)
        self._heard = 0.0  # [s] when a command last came

    @property
    def next(self) -> int:
        """The step at which the base next hears a command; far away where it hears all at once."""
        return NEVER if self._channel is None else self._sending.next

    def command(self, sent: tuple[float, float], step: int) -> tuple[float, float]:
        """The command that the base obeys at a step, where one was sent."""
        if self._channel is None:
            return sent
        time = step * self._timestep
        if self._sending.due(step):
            message = self._channel.pass_on(time, Message(time, np.array([sent]), np.zeros(0)))
            if message is not None and np.isfinite(message.rows).all():  # no base obeys NaN
                v, omega = message.rows[0].tolist()
                self._command, self._heard = (v, omega), time
            elif time - self._heard >= WATCHDOG - 1e-9:
                self._command = (0.0, 0.0)
        return self._command

    def over_floor(self, twists: Array, step: int) -> tuple[Array, Array]:
        """Speeds over the floor (n, 2) for set-points `twists` (n, 2) from `step` on, and the angles that wheels slip.

        The angles (n, 2), left and right [rad], are what the encoders count beside the motion.
        """
        slip = self._slip
        if slip is None:
            return twists, NO_SLIP
        times = (step + np.arange(len(twists))) * self._timestep
        lasts = (times >= slip.start - 1e-9) & (times < slip.end - 1e-9)
        wheels = np.stack(self._drive.wheel_speeds(twists[:, 0], twists[:, 1]), axis=1)
        lost = np.where(lasts[:, None] & np.array([slip.side != "right", slip.side != "left"]), 1.0 - slip.factor, 0.0)
        floor = np.stack(self._drive.twist(*((1.0 - lost) * wheels).T), axis=1)
        return np.where(lasts[:, None], floor, twists), lost * wheels * self._timestep


def _each(scenario: Scenario):
    return () if scenario.faults is None else scenario.faults.each()


# ------------------------------------------------------------------------------------------ sensors


SENSORS = ("odometry", "gyro", "pose", "detections", "lidar")
SCAN = "scan"  # what a reading calls the lidar's messages


class FaultySensors:
    """What the robot hears of each reading. Of a scenario without faults of sensors every reading as it is."""

    def __init__(self, scenario: Scenario, seed: int):
        faults = scenario.faults or Faults()
        lidar = scenario.sensors.scanner
        angles = lidar.angles + lidar.mount[2]
        shapes = {
            "odometry": (1, 2),
            "gyro": (1, 1),
            "pose": (1, 3),
            "detections": (len(scenario.people), 2),
            "lidar": (len(angles), 1),
        }
        given = {name: found for name in SENSORS if (found := getattr(faults, name)) is not None}
        self._channels = {name: FaultyChannel(name, found, shapes[name], seed) for name, found in given.items()}
        self._blocked: Blocked | None = None if faults.lidar is None else faults.lidar.blocked
        self._covered = np.zeros(0, bool) if self._blocked is None else _within(angles, self._blocked.angles)
        self._odometry_pose: Array | None = None

    def hear(self, reading: Reading) -> Reading:
        """The reading as it arrives; `dropped` and `ages` say what did not, and what is old."""
        if not self._channels:
            return reading
        changed: dict[str, Any] = {}
        dropped, ages = list(reading.dropped), list(reading.ages)
        for name, channel in self._channels.items():
            field = SCAN if name == "lidar" else name
            measured = _message(reading, field, self._cover(reading)) if name == "lidar" else _message(reading, field)
            heard = channel.pass_on(reading.time, measured)
            if heard is None:
                changed |= _nothing(reading, field)
                if measured is not None:
                    dropped.append(field)
                continue
            changed |= _fields(reading, field, heard)
            if field != SCAN and heard.time < reading.time:
                ages.append((field, reading.time - heard.time))
        if "odometry" in self._channels:
            changed["odometry_pose"] = self._integrated(reading, changed["odometry"])
        return replace(reading, **changed, dropped=tuple(dropped), ages=tuple(ages))

    def _cover(self, reading: Reading) -> Array:
        """The scan with what a cover on the lidar makes of it."""
        if self._blocked is None or not self._blocked.lasts(reading.time) or not reading.scan.size:
            return reading.scan
        return np.where(self._covered, self._blocked.range, reading.scan)

    def _integrated(self, reading: Reading, odometry: Array) -> Array:
        """Where the odometry that was heard leads."""
        before = reading.odometry_pose * 0.0 if self._odometry_pose is None else self._odometry_pose
        known = bool(np.isfinite(odometry).all())
        self._odometry_pose = integrate(before, odometry[0], odometry[1], reading.interval) if known else before
        return self._odometry_pose


def _within(angles: Array, sector: tuple[float, float]) -> Array:
    """Which beams lie in the sector, counter-clockwise from its first angle to its second, (B,)."""
    first, last = sector
    if last - first >= 2.0 * np.pi:
        return np.ones(len(angles), bool)
    return np.mod(angles - first, 2.0 * np.pi) <= np.mod(last - first, 2.0 * np.pi)


def _message(reading: Reading, field: str, scan: Array | None = None) -> Message | None:
    """What a sensor says in a reading; None where it says nothing."""
    if field in reading.dropped or (scan is not None and not scan.size):
        return None
    if scan is not None:
        return Message(reading.time, scan[:, None], reading.scan_times)
    value = np.asarray(getattr(reading, field), float)
    return Message(reading.time, value if value.ndim == 2 else value.reshape(1, -1), np.zeros(0))


def _fields(reading: Reading, field: str, heard: Message) -> dict[str, Any]:
    """The parts of a reading that a message tells."""
    if field == "gyro":
        return {field: float(heard.rows[0, 0])}
    if field == "detections":
        return {field: heard.rows}
    if field == "pose":
        x, y, heading = heard.rows[0]
        return {field: np.array([x, y, wrap(heading)])}
    if field == SCAN:
        old = heard.time < reading.time and not heard.times.size
        times = np.full(len(heard.rows), heard.time) if old else heard.times
        return {field: np.maximum(heard.rows[:, 0], 0.0), "scan_times": times}
    return {field: heard.rows[0]}


def _nothing(reading: Reading, field: str) -> dict[str, Any]:
    """The same where no message is heard: NaN, and no beams."""
    if field == SCAN:
        return {field: np.zeros(0), "scan_times": np.zeros(0)}
    return {field: np.nan if field == "gyro" else np.full_like(getattr(reading, field), np.nan)}
