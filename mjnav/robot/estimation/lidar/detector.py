"""Detects in a scan what the robot's map does not have, people among it, and says what the scan could have shown.

beams as rays -> returns that the map does not explain -> clusters -> bodies, with the covariance of their centres
  (scan.py)              (clusters.py)                 (clusters.py)  (bodies.py, parts.py)

How much of a disc a scan could have seen: a beam u from o reaches a disc of radius R about c at the lateral offset
a = u x (c - o), |a| <= R, after

    t = u.(c - o) - sqrt(R^2 - a^2)

It stands for all lines of sight within half a step of it, t step / 2 to both sides. It could see the disc where t is
within its range, and where it did not end before the disc: at t - SAME R - 3 sigma at most. What is nearer by less is
the disc itself, which stands elsewhere than was thought. A return from where the map has a surface would have been
explained by it, so that beam could not have shown the disc: of somebody at a wall, only what stands out is seen.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mjnav.compile.compiled import Matrix, Vector, exact
from mjnav.constant import Constant
from mjnav.geometry.distance_field import DistanceField, FieldGrid
from mjnav.geometry.distances import WHOLE_TURN
from mjnav.messages import Array, Detection, Reading, RobotBelief, RobotLimits
from mjnav.noise import Distribution
from mjnav.robot.estimation.base import assumed_noise
from mjnav.robot.estimation.lidar.bodies import find_bodies
from mjnav.robot.estimation.lidar.clusters import GATE, beyond_map, meets_map
from mjnav.robot.estimation.lidar.likelihood_field import beyond_doubt, shared_error
from mjnav.robot.estimation.lidar.scan import MotionHistory, Rays, TwistSensors
from mjnav.scene.sensors import Lidar
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_lidar

# ----------------------------------------------------------------------------- visibility of a disc


SAME = 0.5  # share of the radius by which a disc's own returns may be nearer than its surface was thought to be
SIGHT_SIGMAS = 3.0
LOST = 0.9  # share of the range within which a surface of the map would surely have returned a beam


@exact
def visible_share(rays: Rays, points: Matrix, radius: float, pose: Vector, covariance: Matrix, grid: FieldGrid):
    """The share of the silhouettes of discs at `points` (n, 2) with one radius [m] that the scan could see, (n,).

    pose (3,) and covariance (3, 3): of the robot; grid: of the map's distance field.
    """
    shares = np.zeros(len(points))
    for p in range(len(points)):
        for i in range(len(rays.ranges)):
            distance = rays.ranges[i]
            if not distance >= rays.min_range:
                continue
            ux, uy = rays.directions[i, 0], rays.directions[i, 1]
            dx, dy = points[p, 0] - rays.origins[i, 0], points[p, 1] - rays.origins[i, 1]
            ahead, offset = ux * dx + uy * dy, abs(ux * dy - uy * dx)
            if ahead <= 0.0:
                continue
            half = 0.5 * ahead * rays.step
            overlap = min(offset + half, radius) - max(offset - half, -radius)
            if overlap <= 0.0:
                continue
            enter = ahead - np.sqrt(max(radius * radius - offset * offset, 0.0))
            if not rays.min_range <= enter <= rays.max_range:
                continue
            if distance < enter - SAME * radius - SIGHT_SIGMAS * rays.spread[i]:
                continue
            if distance > rays.max_range and meets_map(rays, i, grid, LOST * rays.max_range, 0.0, 0.0):
                continue
            if beyond_map(rays, i, enter, pose, covariance, grid) <= GATE:
                continue
            shares[p] += overlap / (2.0 * radius)
        shares[p] = min(shares[p], 1.0)
    return shares


# ----------------------------------------------------------------------------------------- detector


PERSON_RADIUS = 0.3  # [m] that the robot takes people to have, the default of a scene's people
PERSON_RADIUS_STD = 0.05  # [m]
MIN_SPREAD = 0.005  # [m] of a range, where its noise is none
MIN_RANGE = 0.01  # [m]; some lidars say 0 where nothing returned
OWN_BODY_SIGMAS = 3.0  # of a range within the robot's body, which is no body's


@dataclass(frozen=True, slots=True)
class ScanDetections(Constant):
    """The bodies that one scan shows, and what it could have shown."""

    detections: tuple[Detection, ...]
    rays: Rays
    pose: Array  # (3,) of the robot
    covariance: Array  # (3, 3)
    field: DistanceField

    def visible(self, points: ArrayLike, radius: float) -> Array:
        """The share of each disc at `points` (n, 2) with a `radius` [m] that the scan could see, (n,).

        Of its silhouette, seen from the lidar: 0 behind something nearer, out of field of view or range, and without a
        scan. Beams from which nothing returned saw nothing where the map has a surface for them to meet. What lies on a
        surface of the map is not seen either.
        """
        points = np.ascontiguousarray(np.reshape(np.asarray(points, float), (-1, 2)))
        return visible_share(self.rays, points, float(radius), self.pose, self.covariance, self.field.grid)


class Detector:
    """Finds in each scan the bodies that the robot's map does not have.

    It goes along with the robot's motion, to know from where each beam was taken: every reading is either detected in
    or followed, in order of time.
    """

    def __init__(self, field: DistanceField, lidar: Lidar, noise: Mapping[str, Distribution], limits: RobotLimits):
        """field: of the map that the robot has; noise: the law that it assumes of each channel."""
        self.field, self._lidar, self._noise = field, lidar, noise["lidar.range"]
        self._history = MotionHistory(TwistSensors.of(noise, limits))
        self._body = limits.half_width - float(np.hypot(*lidar.mount[:2]))  # [m] that the lidar is at least inside it
        self._closed = len(lidar.angles) * lidar.step > WHOLE_TURN - 0.5 * lidar.step

    @classmethod
    def of(cls, scenario: Scenario) -> "Detector":
        """With the scenario's lidar, and the map that the robot has."""
        noise = assumed_noise(scenario)
        field = DistanceField.of(floor_of_lidar(scenario))
        return cls(field, scenario.sensors.scanner, noise, scenario.robot.limits)

    def follow(self, reading: Reading) -> None:
        """Notes the robot's motion in a reading of which the scan is not asked for, as where it has none."""
        self._history.follow(reading)

    def detect(self, reading: Reading, robot: RobotBelief) -> ScanDetections:
        """The bodies in a reading's scan, in the order of the beams, with the robot's belief after that reading."""
        self.follow(reading)
        pose, covariance = np.array(robot.mean, float), np.array(robot.covariance, float, order="C")
        rays = self._rays(reading, pose)
        error = shared_error(rays.origins, rays.directions, rays.ranges, self._lidar, self.field.grid)
        error = beyond_doubt(error, covariance)
        rays = rays._replace(ranges=rays.ranges - error)
        rows = find_bodies(rays, pose, covariance, self.field.grid, PERSON_RADIUS, PERSON_RADIUS_STD)
        return ScanDetections(tuple(map(_detection, rows)), rays, pose, covariance, self.field)

    def _rays(self, reading: Reading, pose: Array) -> Rays:
        """A reading's beams with the robot at `pose` (3,) at its time, their ranges without the lidar's mean error.

        None where the scan did not arrive, has another number of beams than the lidar, or the pose is not finite.
        """
        lidar, num = self._lidar, len(reading.scan)
        if num != len(lidar.angles) or "scan" in reading.dropped or not np.isfinite(pose).all():
            num = 0
        ranges = np.array(reading.scan[:num])
        met = np.where(np.isfinite(ranges), ranges, 0.0)
        spread = np.maximum(np.sqrt(lidar.std(met, self._noise) ** 2 + lidar.resolution**2 / 12.0), MIN_SPREAD)
        ranges[ranges < np.maximum(self._body - OWN_BODY_SIGMAS * spread, MIN_RANGE)] = np.nan  # the robot's own body
        times = reading.time if len(reading.scan_times) != num else reading.scan_times
        times = np.array(np.broadcast_to(times, num), float)
        moved = self._history.poses(times, reading.time)
        x, y, heading = _compose(pose[:, None], moved.T)
        x, y, heading = _compose(np.stack([x, y, heading]), lidar.mount[:, None])
        angles = heading + lidar.angles[:num]
        return Rays(
            origins=np.stack([x, y], axis=1),
            directions=np.stack([np.cos(angles), np.sin(angles)], axis=1),
            ranges=ranges - lidar.known_bias(met, self._noise),
            spread=spread,
            times=times,
            step=lidar.step,
            width=lidar.beam_width,
            closed=self._closed,
            min_range=lidar.min_range,
            max_range=lidar.max_range,
        )


def _compose(pose: Array, within: Array) -> tuple[Array, Array, Array]:
    """Poses `within` (3, n) the frame of `pose` (3, n) in that one's own frame: x, y, heading."""
    (x, y, heading), (dx, dy, turn) = pose, within
    c, s = np.cos(heading), np.sin(heading)
    return x + c * dx - s * dy, y + s * dx + c * dy, heading + turn


def _detection(row: Array) -> Detection:
    x, y, xx, xy, yy, radius, num, time = row.tolist()
    return Detection(time, np.array([x, y]), np.array([[xx, xy], [xy, yy]]), radius, int(num))
