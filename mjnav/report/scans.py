"""Scans as the robot placed them: by what it believed when each beam was taken."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mjnav.messages import Array
from mjnav.noise import Distribution, profile
from mjnav.plugins import DistributionPlugin
from mjnav.scenarios.lidar import Lidar
from mjnav.scenarios.spec import Scenario


def goes_by_scans(scenario: Scenario) -> bool:
    """Whether the robot's pose or the people are estimated from scans, or by estimators of somebody's own."""
    robot, people = scenario.estimation.robot, scenario.estimation.obstacles
    return "lidar" in (robot.source, people.source) or robot.localizer is not None or people.tracker is not None


def range_noise(scenario: Scenario) -> Distribution | None:
    """The law of ranges that the estimators assume; None for one of somebody's own, which would have to be run."""
    assumed = scenario.estimation.assumed_profile
    if assumed is None and (own := scenario.noise.channels.get("lidar.range")) is not None:
        return None if isinstance(own, DistributionPlugin) else own
    return profile(assumed or scenario.noise.profile)["lidar.range"]


@dataclass(frozen=True, slots=True)
class ShownScan:
    """One turn of the lidar."""

    first: float  # [s], when its first beam was taken
    ranges: Array  # (B,) [m], less the lidar's mean error as estimators take them; inf where a beam met nothing

    @classmethod
    def of(cls, message: Any, scenario: Scenario, epoch: int) -> "ShownScan":
        """Of a foxglove.LaserScan, whose stamp counts from `epoch` [ns]."""
        ranges, noise = np.array(message.ranges, float), range_noise(scenario)
        if noise is not None:
            ranges = ranges - scenario.sensors.scanner.known_bias(ranges, noise)
        return cls(1e-9 * (message.timestamp.ToNanoseconds() - epoch), ranges)


@dataclass(frozen=True, slots=True)
class BelievedWay:
    """Where the robot believed to be: at `times` (T,) [s], rising, the poses (T, 3), with headings that do not jump."""

    times: Array
    poses: Array

    @classmethod
    def of(cls, times: Array, poses: Array) -> "BelievedWay":
        """Of the ticks that have an estimate."""
        known = np.isfinite(poses).all(axis=1)
        times, poses = times[known], poses[known].copy()
        poses[:, 2] = np.unwrap(poses[:, 2])
        return cls(times, poses)

    def at(self, times: Array) -> Array:
        """(n, 3) at any times (n,), straight between two ticks, the first and the last pose beyond them."""
        return np.stack([np.interp(times, self.times, column) for column in self.poses.T], axis=-1)


def scan_points(scan: ShownScan, lidar: Lidar, way: BelievedWay) -> Array:
    """Where the beams of a scan that met something end in the robot's map, (n, 2) [m].

    Each beam starts from where the robot believed to be when it was taken, so an error of that belief shows as the
    distance of the points from what they met.
    """
    if not way.times.size:
        return np.zeros((0, 2))
    met = np.flatnonzero(np.isfinite(scan.ranges))
    poses = way.at(scan.first + lidar.turn_offsets[met])
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y, yaw = lidar.mount
    directions = poses[:, 2] + yaw + lidar.angles[met]
    starts = poses[:, :2] + np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    return starts + scan.ranges[met, None] * np.stack([np.cos(directions), np.sin(directions)], axis=-1)
