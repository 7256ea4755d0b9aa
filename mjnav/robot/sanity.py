"""What the robot asks of each sensor before it uses what that says.

A sensor's part of a reading is usable where it arrived, is made of finite numbers, is physically possible, is not older
than it may be and is not the value of before over again: noise never repeats to the last bit. In place of a part that
is not, estimators get the last one that was, and its sensor among `dropped`; so no NaN gets any further than here.
"""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np

from mjnav.messages import Array, Event, Reading
from mjnav.motion.unicycle import integrate
from mjnav.robot.estimation import assumed_noise
from mjnav.scene.ranges import MAX_LENGTH
from mjnav.scene.spec import Scenario

MAX_SPEED = 20.0  # [m/s] that no wheel odometry of such a robot can measure; of the noise profiles' tails none does
MAX_TURN_RATE = 100.0  # [rad/s]
MAX_AGE = 1.0  # [s] of a pose or a scan: so far the odometry carries it without being off by more than centimetres
OWN_BODY = 0.1  # [m] from the lidar, well inside the robot's body of 0.2 m and more: what is nearer is on the lidar
FEW_BEAMS = 10  # returns below which two equal scans may be chance
CALM = 1.0  # [s] without a fault after which a sensor is said to be fine again

# The channels whose noise keeps two values of a sensor from being equal.
_NOISE: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "odometry": ("odometry.v", "odometry.omega"),
        "gyro": ("gyro",),
        "pose": ("pose.x", "pose.y", "pose.theta"),
        "detections": ("detection.x", "detection.y"),
        "scan": ("lidar.range",),
    }
)


class Sanity:
    """Checks the readings of one run, in order of time."""

    def __init__(self, scenario: Scenario):
        noise = assumed_noise(scenario)
        self._noisy = {name for name, channels in _NOISE.items() if all(noise[c].std > 0.0 for c in channels)}
        estimation = scenario.estimation
        self._by_lidar = "lidar" in (estimation.robot.source, estimation.obstacles.source)
        self._before: dict[str, bytes] = {}  # what each sensor said last
        # Where the robot was put is all that it knows before its sensors speak.
        self._last: dict[str, Any] = {
            "odometry": np.zeros(2),
            "gyro": 0.0,
            "pose": np.array(scenario.robot.start),
            "detections": np.full((len(scenario.people), 2), np.nan),
        }
        self._used: dict[str, float] = {}  # [s] when each sensor was last usable
        self._lost: dict[str, float] = {}  # [s] since when it is not; only of those whose latest part was not
        self._told: dict[str, float] = {}  # [s] of the latest fault of those that the log says are faulty
        self._ways: deque[tuple[float, Array]] = deque()  # (time, pose by odometry) of the last MAX_AGE
        self._events: list[Event] = []

    def checked(self, reading: Reading) -> Reading:
        """The reading as it may be used; the same one where nothing is wrong with it."""
        while self._ways and self._ways[0][0] < reading.time - MAX_AGE - 1e-9:
            self._ways.popleft()
        self._ways.append((reading.time, reading.odometry_pose))
        changed: dict[str, Any] = {}
        ages, dropped = dict(reading.ages), []
        for name in _NOISE:
            value = getattr(reading, name)
            if name == "scan" and not value.size and name not in reading.dropped:
                continue  # no turn was due
            cause = "nothing arrives" if name in reading.dropped else self._wrong(name, reading, ages.get(name, 0.0))
            self._tell(name, cause, reading.time)
            if cause:
                self._lost.setdefault(name, self._used.get(name, -np.inf))
                dropped.append(name)
                changed |= (
                    {"scan": np.zeros(0), "scan_times": np.zeros(0)} if name == "scan" else {name: self._last[name]}
                )
                continue
            self._lost.pop(name, None)
            self._used[name] = reading.time
            value = self._mended(name, value, reading, ages.get(name, 0.0))
            if value is not getattr(reading, name):
                changed[name] = value
            self._last[name] = value
        if not changed and not reading.dropped:
            return reading
        return replace(reading, **changed, dropped=tuple(dropped))

    def missing(self, sensor: str, time: float) -> float:
        """For how long nothing usable has come of a sensor [s]; 0 where the latest reading has it, inf at first."""
        return time - self._lost[sensor] if sensor in self._lost else 0.0

    def take_events(self) -> tuple[Event, ...]:
        """Which sensors began to be faulty and which are fine again, since the last call."""
        events, self._events = tuple(self._events), []
        return events

    def _wrong(self, name: str, reading: Reading, age: float) -> str:
        """What is wrong with a part that arrived; empty where nothing is."""
        value = getattr(reading, name)
        bits = np.asarray(value, float).tobytes()
        before, self._before[name] = self._before.get(name), bits
        is_number, is_possible = _CHECKS[name]
        if not is_number(value):
            return "not a number"
        if not is_possible(value):
            return "out of range"
        if name == "scan":
            age = reading.time - float(np.max(reading.scan_times, initial=-np.inf)) if reading.scan_times.size else 0.0
        if age > (MAX_AGE if name in ("pose", "scan") else reading.interval) + 1e-6:
            return f"{age:.2g} s old"
        if bits == before and name in self._noisy:
            known = int(np.isfinite(value).sum())
            if known >= (FEW_BEAMS if name == "scan" else 1):
                return "the same value over again"
        return ""

    def _mended(self, name: str, value: Any, reading: Reading, age: float) -> Any:
        """A usable part: a late pose carried on by odometry, beams that see nothing but the lidar itself as 0."""
        if name == "pose" and age > 0.0:
            return self._carried(value, reading.time - age)
        if name == "scan" and not value.min() >= (OWN_BODY if self._by_lidar else 0.0):  # NaN is not, either
            nearest = OWN_BODY if self._by_lidar else 0.0
            value = np.where(value >= nearest, value, 0.0)
        return value

    def _carried(self, pose: Array, time: float) -> Array:
        """A pose (3,) of an earlier time [s], carried to now by what odometry measured since."""
        then = min(self._ways, key=lambda way: abs(way[0] - time))[1]
        now = self._ways[-1][1]
        c, s = np.cos(pose[2] - then[2]), np.sin(pose[2] - then[2])
        dx, dy = now[:2] - then[:2]
        turned = integrate(pose, 0.0, now[2] - then[2], 1.0)[2]
        return np.array([pose[0] + c * dx - s * dy, pose[1] + s * dx + c * dy, turned])

    def _tell(self, name: str, cause: str, time: float) -> None:
        sensor = "lidar" if name == "scan" else name
        if cause:
            if name not in self._told:
                self._events.append(Event("warning", "sensor", f"{sensor}: {cause}, from {time:g} s on"))
            self._told[name] = time
        elif name in self._told and time - self._told[name] >= CALM - 1e-9:
            since = self._told.pop(name)
            self._events.append(Event("info", "sensor", f"{sensor}: fine again since {since:g} s"))


def _finite(value: Array) -> bool:
    return all(map(isfinite, value.tolist()))  # of two or three numbers quicker than an array's operation


def _whole_rows(value: Array) -> bool:
    """Each person has both coordinates, or, who is not there, none."""
    gaps = np.isnan(value)
    return not gaps.any() or bool((gaps[:, 0] == gaps[:, 1]).all())


def _some_beam(value: Array) -> bool:
    return not np.isnan(value.min()) or not np.isnan(value).all()


def _far(value: Array) -> float:
    """The largest coordinate [m]; 0 where nobody is there."""
    return float(np.fmax.reduce(np.abs(value), axis=None, initial=0.0))


# Whether a sensor's value is made of numbers, and whether it is physically possible.
_CHECKS: Mapping[str, tuple[Callable[[Any], bool], Callable[[Any], bool]]] = MappingProxyType(
    {
        "odometry": (_finite, lambda value: bool(abs(value[0]) <= MAX_SPEED and abs(value[1]) <= MAX_TURN_RATE)),
        "gyro": (isfinite, lambda value: abs(value) <= MAX_TURN_RATE),
        "pose": (_finite, lambda value: bool(max(abs(value[0]), abs(value[1])) <= 2.0 * MAX_LENGTH)),
        "detections": (_whole_rows, lambda value: _far(value) <= 2.0 * MAX_LENGTH),
        "scan": (_some_beam, lambda value: not np.any(value < 0.0)),
    }
)
