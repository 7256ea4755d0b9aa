"""The faults of all sensors, between the measurement and the robot."""

from dataclasses import replace
from typing import Any

import numpy as np

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Reading
from mjnav.motion.unicycle import integrate
from mjnav.scenarios.faults import Blocked, Faults
from mjnav.scenarios.spec import Scenario
from mjnav.world.faults.channel import FaultyChannel, Message

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
