"""A localizer by scans: every scan is fitted to the map by Gauss-Newton, from where the odometry led.

    mjnav run crossing1 --set estimation.robot.localizer=scan_fit.py:ScanFit

With the ends e_i(x) of the beams from a pose x, and their distance d from the nearest surface of the map, it minimises

    sum_i rho(d(e_i(x))) + (x - x_odometry)^T P^-1 (x - x_odometry)

where rho counts nothing that lies beyond `gate` from all surfaces, such as people. The inverse of the last Hessian is
the covariance of the belief. Scan matching by such a field: Hess et al. 2016 (Cartographer), section IV.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.geometry.distance_field import DistanceField
from mjnav.messages import Reading, RobotBelief
from mjnav.motion.unicycle import integrate
from mjnav.rng import stream
from mjnav.robot.estimation import assumed_noise
from mjnav.robot.estimation.base import robot_belief
from mjnav.robot.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar
from mjnav.settings import Range, settle

DRIFT = np.array([0.02, 0.02, 0.02])  # [m, m, rad] std of the odometry's error from scan to scan


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanFitParameters:
    """Keys beside the localizer's name."""

    gate: Annotated[float, Range(0.01, 5.0, "m"), "beyond which a beam's end is no surface of the map"] = 0.3
    spread: Annotated[float, Range(0.001, 1.0, "m"), "standard deviation of a beam's end from its surface"] = 0.05
    steps: Annotated[int, Range(1, 50), "of Gauss-Newton, a scan"] = 4

    def __post_init__(self):
        settle(self)


class ScanFit:
    """Knows where it starts; has the map that the robot has."""

    parameters_type = ScanFitParameters

    def __init__(self, scenario: Scenario, seed: int, parameters: ScanFitParameters):
        self._parameters, self._lidar = parameters, scenario.sensors.scanner
        self._field = DistanceField.of(floor_of_lidar(scenario))
        self._noise = assumed_noise(scenario)
        self._history = MotionHistory(TwistSensors.of(self._noise, scenario.robot.limits))
        self._rng = stream(seed, "scan_fit")
        self._pose, self._covariance = np.array(scenario.robot.start), np.diag(DRIFT**2)

    def update(self, reading: Reading) -> RobotBelief:
        """The belief after one more reading, as 200 particles; reading.pose is left alone."""
        twist = self._history.follow(reading)
        self._pose = integrate(self._pose, twist.v, twist.omega, reading.interval)
        self._covariance = self._covariance + np.diag(DRIFT**2)
        points = scan_points(reading, self._history, self._lidar, self._noise["lidar.range"])
        points = points[np.isfinite(points).all(axis=1)]
        if len(points):
            self._fit(points)
        return robot_belief(reading.time, self._rng.multivariate_normal(self._pose, self._covariance, 200))

    def _fit(self, points: np.ndarray) -> None:
        """Moves the pose to where the points (n, 2), in the robot's frame, lie on the map."""
        prior, weight = self._pose.copy(), np.linalg.inv(self._covariance)
        for _ in range(self._parameters.steps):
            c, s = np.cos(self._pose[2]), np.sin(self._pose[2])
            ends = points @ np.array([[c, s], [-s, c]]) + self._pose[:2]
            distance, slope = self._field.clearance(ends), self._field.gradient(ends)
            used = np.abs(distance) < self._parameters.gate
            turned = np.stack([-(ends[:, 1] - self._pose[1]), ends[:, 0] - self._pose[0]], axis=1)
            jacobian = np.column_stack([slope, (slope * turned).sum(axis=1)])[used] / self._parameters.spread
            hessian = jacobian.T @ jacobian + weight
            downhill = jacobian.T @ (distance[used] / self._parameters.spread) + weight @ (self._pose - prior)
            self._pose = self._pose - np.linalg.solve(hessian, downhill)
        self._covariance = np.linalg.inv(hessian)
