"""A scan as points around the robot, as if all beams had been taken at the moment of the reading.

A turning lidar takes its beams one after another while the robot moves: at 1 rad/s and five turns a second the last
beam is 0.2 rad off the first. The twists of the last readings say where the robot was at each beam's own time.
"""

from collections import deque
from math import cos, sin

import numpy as np

from mjnav.estimation.lidar.twist import Twist, TwistSensors
from mjnav.geometry.compiled import kernel
from mjnav.geometry.kernel_types import Matrix, ReadOnlyVector, Vector
from mjnav.messages import Array, Reading
from mjnav.motion.rows import arc
from mjnav.noise import Distribution
from mjnav.scenarios.lidar import Lidar

KEPT = 12.0  # [s] of twists: more than the turn of the slowest lidar, 10 s


class MotionHistory:
    """How the robot moved of late: the mean twist of each reading's interval, by wheels and gyro."""

    def __init__(self, sensors: TwistSensors):
        self._sensors = sensors
        self._twists: deque[Twist] = deque()
        self._rows: Array | None = None
        self.latest: Twist | None = None

    def follow(self, reading: Reading) -> Twist:
        """The twist of one more reading, the latest; the first reading's interval is none and is left out."""
        self.latest = twist = self._sensors.fused(reading, self.latest)
        if twist.interval > 0.0:
            self._twists.append(twist)
            while self._twists[-1].time - self._twists[0].time > KEPT:
                self._twists.popleft()
            self._rows = None
        return twist

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
