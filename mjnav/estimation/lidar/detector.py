"""What a scan shows that the map does not: people, and things that were not there when the map was made.

beams as rays -> returns that the map does not explain -> clusters -> bodies, with the covariance of their centres
 (rays.py)              (explained.py)                  (clusters.py)  (bodies.py, circle.py)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mjnav.constant import Constant
from mjnav.estimation.lidar.bodies import find_bodies
from mjnav.estimation.lidar.rays import Rays
from mjnav.estimation.lidar.visibility import visible_share
from mjnav.geometry.beams import WHOLE_TURN
from mjnav.geometry.distance_field import DistanceField
from mjnav.messages import Array, Detection, Reading, RobotBelief
from mjnav.noise import Distribution, profile
from mjnav.scenarios.floor import floor_of_robot
from mjnav.scenarios.lidar import Lidar
from mjnav.scenarios.spec import Scenario

PERSON_RADIUS = 0.3  # [m] that the robot takes people to have, the default of a scene's people
PERSON_RADIUS_STD = 0.05  # [m]
MIN_SPREAD = 0.005  # [m] of a range, where its noise is none


@dataclass(frozen=True, slots=True)
class ScanDetections(Constant):
    """The bodies that one scan shows, and what it could have shown."""

    detections: tuple[Detection, ...]
    rays: Rays
    field: DistanceField

    def visible(self, points: ArrayLike, radius: float) -> Array:
        """The share of each disc at `points` (n, 2) with a `radius` [m] that the scan could see, (n,).

        Of its silhouette, seen from the lidar: 0 behind something nearer, out of field of view or range, and without a
        scan. Beams from which nothing returned saw nothing where the map has a surface for them to meet.
        """
        points = np.ascontiguousarray(np.reshape(np.asarray(points, float), (-1, 2)))
        return visible_share(self.rays, points, float(radius), self.field.grid)


class Detector:
    """Finds in each scan the bodies that the robot's map does not have."""

    def __init__(self, field: DistanceField, lidar: Lidar, noise: Distribution):
        """field: of the map that the robot has; noise: the law that it assumes of the channel lidar.range."""
        self._field, self._lidar, self._noise = field, lidar, noise
        self._step = float(lidar.angles[1] - lidar.angles[0]) if len(lidar.angles) > 1 else WHOLE_TURN
        self._closed = len(lidar.angles) * self._step > WHOLE_TURN - 0.5 * self._step

    @classmethod
    def of(cls, scenario: Scenario) -> "Detector":
        """With the scenario's map and lidar."""
        assumed = scenario.estimation.assumed_profile
        noise = (scenario.noise.distributions() if assumed is None else profile(assumed))["lidar.range"]
        floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
        return cls(DistanceField.of(floor), scenario.sensors.scanner, noise)

    def detect(self, reading: Reading, robot: RobotBelief) -> ScanDetections:
        """The bodies in a reading's scan, in the order of the beams, with the robot's belief after that reading."""
        rays = self._rays(reading, robot.mean)
        rows = find_bodies(rays, robot.mean, robot.covariance, self._field.grid, PERSON_RADIUS, PERSON_RADIUS_STD)
        return ScanDetections(tuple(map(_detection, rows)), rays, self._field)

    def _rays(self, reading: Reading, pose: Array) -> Rays:
        """A reading's beams from the robot's pose (3,), their ranges without the lidar's mean error."""
        lidar, num = self._lidar, len(reading.scan)
        silent = num != len(lidar.angles) or not np.isfinite(pose).all()
        ranges = np.zeros(0) if silent else np.where(reading.scan > 0.0, reading.scan, np.nan)
        num = len(ranges)
        met = np.where(np.isfinite(ranges), ranges, 0.0)
        spread = np.sqrt(lidar.std(met, self._noise) ** 2 + lidar.resolution**2 / 12.0)
        angles = pose[2] + lidar.mount[2] + lidar.angles[:num]
        c, s = np.cos(pose[2]), np.sin(pose[2])
        origin = pose[:2] + np.array([[c, -s], [s, c]]) @ lidar.mount[:2]
        return Rays(
            origins=np.ascontiguousarray(np.broadcast_to(origin, (num, 2))),
            directions=np.stack([np.cos(angles), np.sin(angles)], axis=1),
            ranges=ranges - lidar.bias(met, self._noise),
            spread=np.maximum(spread, MIN_SPREAD),
            times=np.array(reading.scan_times) if len(reading.scan_times) == num else np.full(num, reading.time),
            step=self._step,
            closed=self._closed,
            min_range=lidar.min_range,
            max_range=lidar.max_range,
        )


def _detection(row: Array) -> Detection:
    x, y, xx, xy, yy, radius, num, time = row.tolist()
    return Detection(time, np.array([x, y]), np.array([[xx, xy], [xy, yy]]), radius, int(num))
