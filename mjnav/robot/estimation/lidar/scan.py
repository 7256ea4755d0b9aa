"""Inputs of the estimators by lidar: the robot's twist from odometry and gyro, and a scan as points and as rays.

Two unbiased readings of one turn rate with variances s_o^2 and s_g^2 make the best linear estimate

    omega = a (odometry - mean_o) + (1 - a) (gyro - mean_g),   a = s_g^2 / (s_o^2 + s_g^2)

whose error is the same sum of the two errors. A particle draws both errors from their channels' own laws, so that the
sum keeps their shape. Where one of the two sensors fails, the twist says what is still known.

A robot whose last STILL readings cannot be told from rest stands, and does not move in its belief (a zero-velocity
update): the noise of wheels that stand would else carry it away, 5 cm in half a minute.

The points lie around the robot as if all beams had been taken at the moment of the reading. A turning lidar takes its
beams one after another while the robot moves: at 1 rad/s and five turns a second the last beam is 0.2 rad off the
first. The twists of the last readings say where the robot was at each beam's own time.

The rays lie in the world, as the detector's kernels take them.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from mjnav.compile.compiled import Matrix, ReadOnlyVector, Vector, kernel
from mjnav.constant import Constant
from mjnav.messages import Array, Reading, RobotLimits
from mjnav.motion.unicycle import arc
from mjnav.noise import Distribution
from mjnav.robot.estimation.base import widened
from mjnav.scene.sensors import Lidar

# -------------------------------------------------------------------------------------------- twist


TWIST_CHANNELS = ("odometry.v", "odometry.omega", "gyro")
CONFLICT = 6.0  # standard deviations of their difference at which wheels and gyro contradict each other
UNKNOWN_SHARE = 0.3  # of the robot's limits: standard deviation of a component that nothing measured


@dataclass(frozen=True, slots=True)
class Twist:
    """The mean twist over one interval: its estimate, and what that is made of."""

    time: float  # [s] at which the interval ends
    interval: float  # [s]
    v: float  # [m/s]
    omega: float  # [rad/s]
    std: tuple[float, float]  # of v [m/s] and omega [rad/s]
    wheels: float  # share a of the wheels in omega
    knows_v: bool  # whether anything measured v in this interval, and omega
    knows_omega: bool
    rivals: tuple[float, float] | None = None  # omega by the wheels and by the gyro, where they contradict each other
    stands: bool = False  # v and omega are 0

    @property
    def covariance(self) -> Array:
        """Of (v, omega), (2, 2), diagonal."""
        return np.diag(np.square(self.std))


@dataclass(frozen=True, slots=True)
class TwistSensors(Constant):
    """What wheels and gyro are assumed to be worth."""

    v: Distribution
    omega: Distribution
    gyro: Distribution
    unknown: tuple[float, float]  # std of v [m/s] and omega [rad/s] where nothing measured them

    @classmethod
    def of(cls, noise: Mapping[str, Distribution], limits: RobotLimits) -> "TwistSensors":
        """By the assumed noise, widened where it has nearly none."""
        v, omega, gyro = (widened(channel, noise[channel]) for channel in TWIST_CHANNELS)
        return cls(v, omega, gyro, (UNKNOWN_SHARE * limits.max_speed, UNKNOWN_SHARE * limits.max_turn_rate))

    def fused(self, reading: Reading, before: Twist | None = None) -> Twist:
        """The twist over the interval of a reading; a component that nothing measured is the one of `before`.

        Not measured is what the reading says was dropped, and what is not finite.
        """
        v, omega = np.asarray(reading.odometry, float).tolist()
        has_wheels = "odometry" not in reading.dropped
        has_v, has_omega = has_wheels and np.isfinite(v), has_wheels and np.isfinite(omega)
        has_gyro = "gyro" not in reading.dropped and np.isfinite(reading.gyro)
        by_wheels, by_gyro = omega - self.omega.mean, float(reading.gyro) - self.gyro.mean
        variance = self.omega.std**2 + self.gyro.std**2
        share = self.gyro.std**2 / variance if has_omega and has_gyro else float(has_omega)
        rivals = None
        if has_omega and has_gyro:
            fused, std = share * by_wheels + (1.0 - share) * by_gyro, self.omega.std * self.gyro.std / sqrt(variance)
            if abs(by_wheels - by_gyro) > CONFLICT * sqrt(variance):
                rivals, std = (by_wheels, by_gyro), 0.5 * abs(by_wheels - by_gyro)
        elif has_omega or has_gyro:
            fused, std = (by_wheels, self.omega.std) if has_omega else (by_gyro, self.gyro.std)
        else:
            fused, std = (0.0 if before is None else before.omega), self.unknown[1]
        if has_v:
            speed, speed_std = v - self.v.mean, self.v.std
        else:
            speed, speed_std = (0.0 if before is None else before.v), self.unknown[0]
        return Twist(
            reading.time,
            reading.interval,
            speed,
            fused,
            (speed_std, std),
            share,
            bool(has_v),
            bool(has_omega or has_gyro),
            rivals,
        )

    def sample(
        self, twist: Twist, num: int, rngs: Mapping[str, np.random.Generator], blind: tuple[int, int] = (0, 0)
    ) -> tuple[Array, Array]:
        """Draws of v and omega, (num,) each, from generators by channel; each draws as often whatever was measured.

        Where wheels and gyro contradict each other, every other draw goes by the one. `blind` says for how many
        intervals v and omega were not measured before this one: an error that stays grows with the time and not with
        its root, so the draws of interval k spread by sqrt(2 k + 1) as much.
        """
        v, omega, gyro = (
            channel.sample(rngs[name], num) - channel.mean
            for name, channel in zip(TWIST_CHANNELS, (self.v, self.omega, self.gyro), strict=True)
        )
        if twist.rivals is not None:
            found = np.where(np.arange(num) % 2 == 0, twist.rivals[0] - omega, twist.rivals[1] - gyro)
        elif twist.knows_omega:
            found = twist.omega - twist.wheels * omega - (1.0 - twist.wheels) * gyro
        else:
            found = twist.omega + self.unknown[1] * sqrt(2.0 * blind[1] + 1.0) / self.gyro.std * gyro
        if not twist.knows_v:
            v *= self.unknown[0] * sqrt(2.0 * blind[0] + 1.0) / self.v.std
        if twist.stands:
            return np.zeros(num), np.zeros(num)
        return twist.v - v, found


# ----------------------------------------------------------------------------------- scan as points


STILL = 5  # readings by which a robot is taken to stand
REST = 2.0  # standard deviations of their mean that are no motion
KEPT = 12.0  # [s] of twists: more than the turn of the slowest lidar, 10 s


class MotionHistory:
    """How the robot moved of late: the mean twist of each reading's interval, by wheels and gyro."""

    def __init__(self, sensors: TwistSensors):
        self._sensors = sensors
        self._twists: deque[Twist] = deque()
        self._recent: deque[Twist] = deque(maxlen=STILL)  # as measured
        self._rows: Array | None = None
        self.latest: Twist | None = None

    def follow(self, reading: Reading) -> Twist:
        """The twist of one more reading, the latest; the first reading's interval is none and is left out."""
        self.latest = twist = self._sensors.fused(reading, self.latest)
        self._recent.append(twist)
        if self._stands():
            twist = replace(twist, v=0.0, omega=0.0, stands=True)
        if twist.interval > 0.0:
            self._twists.append(twist)
            while self._twists[-1].time - self._twists[0].time > KEPT:
                self._twists.popleft()
            self._rows = None
        return twist

    def _stands(self) -> bool:
        recent = self._recent
        if len(recent) < STILL or not all(t.knows_v and t.knows_omega and t.rivals is None for t in recent):
            return False
        v, omega = sum(t.v for t in recent), sum(t.omega for t in recent)
        std = recent[-1].std
        return bool(abs(v) <= REST * sqrt(STILL) * std[0] and abs(omega) <= REST * sqrt(STILL) * std[1])

    @property
    def rows(self) -> Array:
        """Time at which it ends [s], length [s], v and omega of each interval, the latest first, (k, 4)."""
        if self._rows is None:
            rows = [(twist.time, twist.interval, twist.v, twist.omega) for twist in reversed(self._twists)]
            self._rows = np.array(rows, float).reshape(-1, 4)
        return self._rows

    def poses(self, times: Array, now: float) -> Array:
        """The robot's pose at each of `times` (k,) [s] in its own frame at `now`, (k, 3).

        Before the first interval the robot is taken to have gone on as in it.
        """
        return _poses(np.array(times, float), now, self.rows)


def scan_points(reading: Reading, history: MotionHistory, lidar: Lidar, noise: Distribution | None = None) -> Array:
    """Where the beams of a reading ended, in the robot's frame at reading.time, (B, 2) [m].

    NaN for beams that met nothing or are out of the lidar's range, (0, 2) without a scan. `history` ends with the
    reading's own interval. With `noise`, the law of the channel lidar.range, the lidar's mean error is taken off.
    """
    ranges = np.asarray(reading.scan, float)
    if not ranges.size or "scan" in reading.dropped:
        return np.zeros((0, 2))
    with np.errstate(invalid="ignore"):
        usable = (ranges > max(lidar.min_range, 0.0)) & (ranges < np.inf)
    ranges = np.where(usable, ranges, np.nan)
    if noise is not None:
        ranges = ranges - lidar.known_bias(ranges, noise)
    times = np.array(reading.scan_times, float)
    return _points(ranges, lidar.angles, times, reading.time, lidar.mount, history.rows)


@kernel
def _pose_at(time, now, rows):
    """See `MotionHistory.poses`, of one time; the intervals `rows` (k, 4) are the latest first."""
    x, y, heading = 0.0, 0.0, 0.0
    at, last = now, len(rows) - 1
    for k in range(len(rows)):
        if at <= time:
            break
        until = time if k == last else max(time, rows[k, 0] - rows[k, 1])
        x, y, heading = arc(x, y, heading, rows[k, 2], rows[k, 3], until - at)
        at = until
    return x, y, heading


@kernel
def _poses(times: Vector, now: float, rows: Matrix):
    found = np.empty((len(times), 3))
    for i in range(len(times)):
        found[i, 0], found[i, 1], found[i, 2] = _pose_at(times[i], now, rows)
    return found


@kernel
def _points(ranges: Vector, angles: ReadOnlyVector, times: Vector, now: float, mount: ReadOnlyVector, rows: Matrix):
    """See `scan_points`; all beams are of `now` where there are no `times`."""
    found = np.empty((len(ranges), 2))
    x, y, heading, at = 0.0, 0.0, 0.0, now
    for i in range(len(ranges)):
        if len(times) and times[i] != at:  # a packet of beams shares its time
            x, y, heading = _pose_at(times[i], now, rows)
            at = times[i]
        c, s = cos(heading), sin(heading)
        direction = heading + mount[2] + angles[i]
        found[i, 0] = x + c * mount[0] - s * mount[1] + ranges[i] * cos(direction)
        found[i, 1] = y + s * mount[0] + c * mount[1] + ranges[i] * sin(direction)
    return found


# ------------------------------------------------------------------------------------- scan as rays


class Rays(NamedTuple):
    """B beams in the order in which they were taken, in the world by the mean of the robot's belief."""

    origins: Matrix  # (B, 2) [m] of the lidar when the beam was taken
    directions: Matrix  # (B, 2) unit vectors
    ranges: Vector  # (B,) [m]; inf where nothing returned, NaN for a beam that says nothing
    spread: Vector  # (B,) [m] standard deviation of the range
    times: Vector  # (B,) [s]
    step: float  # [rad] between neighbouring beams
    width: float  # [rad] of a beam
    closed: bool  # whether the last beam is a neighbour of the first one
    min_range: float  # [m]
    max_range: float  # [m]
