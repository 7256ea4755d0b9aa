"""Kalman filters of the robot's pose whose measurement is the pose at which the scan matches the map.

    predict   by odometry and gyro                                           (`scan`, `estimation.kalman`)
    match     the scan on the map, from the prediction x, P: a pose z, R      (`scan_matching`)
    gate      (z - x)^T (P + R)^-1 (z - x) <= chi-squared
    correct   x, P by z, R

A match that the prediction excludes, or that explains little of the scan, is not taken. After a few scans that are not
explained the filter looks for a better place all over the floor (`recovery`), as it does at the first scan where no
start is given. Without a scan it only predicts, and its covariance grows.

The measurement belongs to a moment that has passed: a lidar takes a turn before it hands it over, and the motion since
is known with errors that also moved the prediction. So the filter stands at the moment of its latest measurement; what
is believed now is carried there from it.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.linalg import solve

from mjnav.constant import Constant
from mjnav.estimation.base import PoseEstimator, assumed_noise
from mjnav.estimation.kalman import ExtendedPoseFilter, PoseFilter, UnscentedPoseFilter, pose_residual
from mjnav.estimation.lidar.likelihood_field import LikelihoodField, put_right
from mjnav.estimation.lidar.localizer import LEAST_RETURNS, START_STD, field_and_search
from mjnav.estimation.lidar.recovery import FloorSearch, Relocation
from mjnav.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.estimation.lidar.scan_matching import MatchSettings, match_scan, reach_of, weighted_law
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.rng import stream
from mjnav.scenarios.spec import Scenario

# ------------------------------------------------------------------------ Gaussian of a past moment


SAME = 1e-9  # [s] below which two moments are one


@dataclass(frozen=True, slots=True)
class Motion:
    """A twist from `begin` to `end` [s], of which any part may be undone.

    Its error is taken for white noise within: the way of a part of length s has the covariance density s.
    """

    begin: float
    end: float
    twist: Array  # (2,) v [m/s], omega [rad/s]
    density: Array  # (2, 2), covariance of the mean twist times the interval

    def move(self, pose: PoseFilter) -> None:
        """Predicts over the whole of it."""
        interval = self.end - self.begin
        pose.predict(self.twist, self.density / interval, interval)

    def split(self, time: float) -> tuple["Motion", "Motion"]:
        """What was before `time` [s] and what came after."""
        return Motion(self.begin, time, self.twist, self.density), Motion(time, self.end, self.twist, self.density)


class DelayedPose:
    """A pose filter at a moment of the past, and the motions since."""

    def __init__(self, make: Callable[[], PoseFilter], kept: float):
        """Measurements may be up to `kept` [s] old."""
        self.past, self._now, self._kept = make(), make(), kept
        self._time = -np.inf  # [s] of the past; before the first motion it is any
        self._since: deque[Motion] = deque()

    def move(self, motion: Motion) -> None:
        """Goes on by a motion that begins where the latest one ended."""
        self._since.append(motion)
        self.go_to(motion.end - self._kept)

    def go_to(self, time: float) -> bool:
        """Takes the past on to `time` [s]; whether it is not there already or beyond."""
        if time <= self._time + SAME:
            return False
        while self._since and self._since[0].begin < time - SAME:
            motion = self._since.popleft()
            if motion.end > time + SAME:
                motion, rest = motion.split(time)
                self._since.appendleft(rest)
            motion.move(self.past)
        self._time = time
        return True

    @property
    def now(self) -> PoseFilter:
        """The past carried on to the end of the latest motion."""
        if not self._since:
            return self.past
        self._now.start(self.past.mean, self.past.covariance)
        for motion in self._since:
            motion.move(self._now)
        return self._now


# ---------------------------------------------------------------------- localizers by scan matching


LEAST_STD = 2e-3  # [m] of a range
SLACK = 0.5  # [s] that a scan may be older than a turn


@dataclass(frozen=True, slots=True)
class GateSettings(Constant):
    """When a match is taken for a measurement.

    distance   squared, of prediction and match: 99.99 % of chi-squared with three degrees of freedom
    explained  least mean weight of the scan's points
    """

    distance: float = 21.1
    explained: float = 0.2


class ScanMatchingLocalizer(PoseEstimator, ABC):
    """What the Kalman filters share. They start at a pose; `particles` are draws from their Gaussian."""

    def __init__(
        self,
        field: LikelihoodField,
        search: FloorSearch,
        twists: TwistSensors,
        start: Array | None,
        num_particles: int,
        seed: int,
        *,
        gate: GateSettings | None = None,
        match: MatchSettings | None = None,
    ):
        """`start` (3,) is where the robot is in the beginning; None for anywhere on the floor."""
        super().__init__(seed)
        self._field = field
        self._gate, match = gate or GateSettings(), match or MatchSettings()
        self._centre, variance = weighted_law(field.noise, match)
        self._match = replace(match, inflation=variance * match.inflation)
        self._reach = reach_of(field.lidar, field.noise)
        self._relocation = Relocation(field, search, seed, self._match)
        self._blind = np.zeros(2, int)  # intervals in a row in which v and omega were not measured
        self._history = MotionHistory(twists)
        turn = 0.0 if field.lidar.rate is None else 1.0 / field.lidar.rate
        self._pose = DelayedPose(self._make, turn + SLACK)
        self._anywhere = start is None  # until the first scan
        if start is None:
            places = search.places
            spread = np.square([*(places.std(axis=0) + search.cell), np.pi])
            self._pose.past.start(np.append(places.mean(axis=0), 0.0), np.diag(spread))
        else:
            self._pose.past.start(np.array(start, float), np.diag(np.square(START_STD)))
        self._num, self._stream = num_particles, stream(seed, "estimation.gaussian")

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> "ScanMatchingLocalizer":
        """With the scenario's map, lidar and assumed noise."""
        noise, robot, choice = assumed_noise(scenario), scenario.robot, scenario.estimation.robot
        field, search = field_and_search(scenario)
        start = None if choice.start == "global" else np.array(robot.start)
        return cls(field, search, TwistSensors.of(noise, robot.limits), start, choice.particles, seed)

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading."""
        if reading.interval > 0.0:
            self._predict(reading)
        recovered = self._see(reading)
        self._belief = self._pose.now.belief(reading.time, self._num, self._stream, recovered)
        return self._belief

    def _predict(self, reading: Reading) -> None:
        """Moves the belief over a reading's interval.

        The error of a twist that nothing measures stays from interval to interval: its part in the variance of the way
        grows with k^2 after k intervals, by 2 k + 1 in the next one.
        """
        twist = self._history.follow(reading)
        self._blind = np.where([twist.knows_v, twist.knows_omega], 0, self._blind + 1)
        covariance = twist.covariance * np.maximum(2 * self._blind - 1, 1)
        begin = twist.time - twist.interval
        velocity = np.array([twist.v, twist.omega])
        self._pose.move(Motion(begin, twist.time, velocity, covariance * twist.interval))

    def _see(self, reading: Reading) -> bool:
        """Takes what a reading's scan says; whether the filter has started again.

        Its points are those of the robot's frame at the mean time of the beams, to which the filter is taken.
        """
        points = scan_points(reading, self._history, self._field.lidar, self._field.noise)
        if self._field.is_empty or np.count_nonzero(np.isfinite(points[:, 0])) < LEAST_RETURNS:
            return False
        time = float(np.mean(reading.scan_times)) if len(reading.scan_times) else reading.time
        if not self._pose.go_to(time):
            return False
        ((x, y, heading),) = self._history.poses(np.array([time]), reading.time)
        c, s = np.cos(heading), np.sin(heading)
        return self._correct(*self._centred((points - [x, y]) @ np.array([[c, -s], [s, c]]), reading.scan))

    def _centred(self, points: Array, scan: Array) -> tuple[Array, Array]:
        """Points (B, 2) brought to where a match takes them to be right, and the std of their ranges (B,) [m]."""
        lidar, ranges = self._field.lidar, np.nan_to_num(scan, posinf=0.0)
        std = np.sqrt(lidar.std(ranges, self._field.noise) ** 2 + lidar.resolution**2 / 12.0 + LEAST_STD**2)
        away = points - lidar.mount[:2]
        away /= np.maximum(np.hypot(away[:, 0], away[:, 1]), LEAST_STD)[:, None]
        return points - (self._centre * std)[:, None] * away, std

    def _correct(self, points: Array, std: Array) -> bool:
        """Takes what a scan says at the moment of the past; whether the filter has started again."""
        past, gate = self._pose.past, self._gate
        if self._anywhere:
            found, self._anywhere = self._relocation.anywhere(points, std), False
            past.start(found.pose, found.covariance)
            return False
        points = put_right(points, self._field.lidar, past.mean, past.covariance, self._field.field.grid)
        match = match_scan(self._field.field, points, std, past.mean, self._match, self._reach)
        innovation = pose_residual(match.pose, past.mean)
        distance = float(innovation @ solve(past.covariance + match.covariance, innovation))
        taken = match.explained >= gate.explained and distance <= gate.distance
        if taken:
            past.correct(match.pose, match.covariance)
        found = self._relocation.elsewhere(points, std, match, taken)
        if found is None or found.explained < gate.explained:
            return False
        past.start(found.pose, found.covariance)
        return True

    @abstractmethod
    def _make(self) -> PoseFilter:
        """The filter of the pose."""


class ExtendedScanLocalizer(ScanMatchingLocalizer):
    """By an extended Kalman filter."""

    def _make(self) -> PoseFilter:
        return ExtendedPoseFilter()


class UnscentedScanLocalizer(ScanMatchingLocalizer):
    """By an unscented Kalman filter."""

    def _make(self) -> PoseFilter:
        return UnscentedPoseFilter()
