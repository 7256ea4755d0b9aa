"""The robot's pose by a Kalman filter whose measurement is the pose at which the scan matches the map.

    predict   by odometry and gyro                                           (`twist`, `pose_filter`)
    match     the scan on the map, from the prediction x, P: a pose z, R      (`scan_matching`)
    gate      (z - x)^T (P + R)^-1 (z - x) <= chi-squared
    correct   x, P by z, R

A match that the prediction excludes, or that explains little of the scan, is not taken. After a few scans in a row that
are not explained, the whole map is searched (`pose_search`), and the filter starts again where the scan fits clearly
better; so it does at the first scan where nobody says where the robot starts. One Gaussian holds one place: of places
that look alike it takes the best. Without a scan the filter only predicts, and its covariance grows.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.linalg import solve

from mjnav.constant import Constant
from mjnav.estimation.assumed import assumed_noise
from mjnav.estimation.base import PoseEstimator
from mjnav.estimation.lidar.beams import MotionHistory, scan_points
from mjnav.estimation.lidar.delayed import DelayedPose, Motion
from mjnav.estimation.lidar.pose_search import PoseSearch
from mjnav.estimation.lidar.scan_matching import MatchSettings, ScanMatch, match_scan, weighted_centre
from mjnav.estimation.lidar.twist import Twist, TwistSensors
from mjnav.estimation.pose_filter import ExtendedPoseFilter, PoseFilter, UnscentedPoseFilter, pose_residual
from mjnav.geometry.distance_field import DistanceField
from mjnav.messages import Array, Reading, RobotBelief
from mjnav.noise import Distribution
from mjnav.rng import stream
from mjnav.scenarios.lidar import Lidar
from mjnav.scenarios.spec import Scenario

CELL = 0.025  # [m] of the field: beside a leg of 3 cm radius it errs by 5 mm
START_STD = (0.1, 0.1, 0.05)  # [m], [m], [rad] of where the robot was put
LEAST_STD = 2e-3  # [m] of a range
SLACK = 0.5  # [s] that a scan may be older than a turn


@dataclass(frozen=True, slots=True)
class GateSettings(Constant):
    """When a match is taken for a measurement.

    distance   squared, of prediction and match: 99.99 % of chi-squared with three degrees of freedom
    explained  least mean weight of the scan's points
    doubtful   mean weight below which the place may be wrong altogether; 0.6 to 0.8 is common
    patience   scans in a row, doubtful or not taken, before the map is searched; after a search in vain twice as many
    better     by which a place elsewhere has to fit better
    """

    distance: float = 21.1
    explained: float = 0.2
    doubtful: float = 0.45
    patience: int = 5
    better: float = 0.15


class ScanMatchingLocalizer(PoseEstimator, ABC):
    """What the Kalman filters share. They start at a pose; `particles` are draws from their Gaussian."""

    def __init__(
        self,
        field: DistanceField,
        lidar: Lidar,
        noise: Mapping[str, Distribution],
        twists: TwistSensors,
        start: Array | None,
        num_particles: int,
        seed: int,
        *,
        gate: GateSettings | None = None,
        match: MatchSettings | None = None,
    ):
        """field: of the robot's map; noise: the laws that it assumes; start (3,): where it was put, if it knows."""
        super().__init__(seed)
        self._field, self._lidar, self._noise = field, lidar, noise["lidar.range"]
        self._gate, self._match = gate or GateSettings(), match or MatchSettings()
        self._centre = weighted_centre(self._noise, self._match)
        self._twists, self._twist = twists, None
        self._blind = np.zeros(2, int)  # intervals in a row in which v and omega were not measured
        self._history = MotionHistory()
        kept = SLACK + (0.0 if lidar.rate is None else 1.0 / lidar.rate)
        self._pose = DelayedPose(self._make, kept)
        self._search = PoseSearch(field, self._match)
        self._lost = start is None
        if start is None:
            self._pose.past.start(*self._search.anywhere)
        else:
            self._pose.past.start(np.array(start, float), np.diag(np.square(START_STD)))
        self._doubtful = 0  # scans in a row
        self._patience = self._gate.patience  # scans until the next search
        self._num, self._stream = num_particles, stream(seed, "estimation.gaussian")

    @classmethod
    def of(cls, scenario: Scenario, seed: int) -> "ScanMatchingLocalizer":
        """With the scenario's map, lidar and assumed noise."""
        from mjnav.scenarios.floor import floor_of_lidar

        noise, robot = assumed_noise(scenario), scenario.robot
        return cls(
            DistanceField.of(floor_of_lidar(scenario.known_bodies), CELL),
            scenario.sensors.scanner,
            noise,
            TwistSensors.of(noise, robot.limits),
            None if scenario.estimation.robot.start == "global" else np.array(robot.start),
            scenario.estimation.robot.particles,
            seed,
        )

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
        twist = self._twists.fused(reading, self._twist)
        self._blind = np.where([twist.knows_v, twist.knows_omega], 0, self._blind + 1)
        covariance = twist.covariance * np.maximum(2 * self._blind - 1, 1)
        begin = twist.time - twist.interval
        velocity = np.array([twist.v, twist.omega])
        self._pose.move(Motion(begin, twist.time, velocity, covariance * twist.interval))
        self._history.add(twist)
        self._twist: Twist | None = twist

    def _see(self, reading: Reading) -> bool:
        """Takes what a reading's scan says; whether the filter has started again.

        The points are those of the robot's frame at the mean time of the beams, to which the filter is taken.
        """
        points = scan_points(reading, self._history, self._lidar, self._noise)
        if not np.isfinite(points).any():
            return False
        time = float(np.mean(reading.scan_times)) if len(reading.scan_times) else reading.time
        if not self._pose.go_to(time):
            return False
        ((x, y, heading),) = self._history.poses(np.array([time]), reading.time)
        c, s = np.cos(heading), np.sin(heading)
        points = (points - [x, y]) @ np.array([[c, -s], [s, c]])
        ranges = np.nan_to_num(reading.scan, posinf=0.0)
        lidar = self._lidar
        std = np.maximum(np.sqrt(lidar.std(ranges, self._noise) ** 2 + lidar.resolution**2 / 12.0), LEAST_STD)
        away = points - lidar.mount[:2]
        away /= np.maximum(np.hypot(away[:, 0], away[:, 1]), LEAST_STD)[:, None]
        return self._correct(points - (self._centre * std)[:, None] * away, std)

    def _correct(self, points: Array, std: Array) -> bool:
        """Takes what a scan says; whether the filter has started again."""
        if self._lost:
            found = self._search.best(points, std)
            if found is not None:
                self._pose.past.start(found.pose, found.covariance)
                self._lost = False
            return False
        match = match_scan(self._field, points, std, self._pose.past.mean, self._match)
        innovation = pose_residual(match.pose, self._pose.past.mean)
        distance = float(innovation @ solve(self._pose.past.covariance + match.covariance, innovation))
        taken = match.explained >= self._gate.explained and distance <= self._gate.distance
        if taken:
            self._pose.past.correct(match.pose, match.covariance)
        if taken and match.explained >= self._gate.doubtful:
            self._doubtful, self._patience = 0, self._gate.patience
            return False
        self._doubtful += 1
        if self._doubtful < self._patience:
            return False
        self._doubtful, self._patience = 0, 2 * self._patience
        return self._start_elsewhere(points, std, match, taken)

    def _start_elsewhere(self, points: Array, std: Array, match: ScanMatch, taken: bool) -> bool:
        """Starts again from a place that fits better than the match, or from a match that was not taken."""
        here = self._search.fit(points, match)
        found = self._search.best(points, std)
        if found is None or found.explained < max(here, self._gate.explained) + self._gate.better:
            if taken or here < self._gate.explained:
                return False
            found = match
        self._pose.past.start(found.pose, found.covariance)
        self._patience = self._gate.patience
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
