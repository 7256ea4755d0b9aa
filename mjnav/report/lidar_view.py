"""For pictures and films: what a robot that localizes or tracks people by its lidar sees and believes at each moment.

`scan_points` places a scan as the robot did: by the pose that it believed when each beam was taken.
"""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.log.log_format import epoch_ns
from mjnav.log.read.log import Log
from mjnav.messages import Array
from mjnav.noise import Distribution, profile
from mjnav.scene.sensors import Lidar
from mjnav.scene.spec import Scenario
from mjnav.settings.plugins import DistributionPlugin


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


_SAME = 1e-6  # [s] between two moments that are one


@dataclass(frozen=True, slots=True)
class LidarView:
    """One moment; None where the robot does not go by scans, or there was none yet."""

    scan: Array | None = None  # (n, 2) [m] where its beams end
    detections: Array | None = None  # (n, 3) x, y, radius [m]
    tracks: Array | None = None  # (n, 4) x, y, vx, vy; where they are by now
    coasts: NDArray[np.bool_] | None = None  # (n,) nothing is seen of them

    @property
    def drawn(self) -> dict[str, Any]:
        """As `world.render.Renderer.draw` takes it."""
        names = ("scan", "detections", "tracks", "coasts")
        return {name: value for name in names if (value := getattr(self, name)) is not None}


class LidarViews:
    """All moments of a log."""

    def __init__(self, log: Log):
        self._scans: dict[float, Array] = {}
        self._detections: dict[float, Array] = {}
        self._tracks: dict[float, Array] = {}  # (n, 5), the last column is the time unseen [s]
        scenario = log.scenario()
        self._seen = scenario.sensors.longest_pause - _SAME  # [s] that a track may be unseen between two scans
        if not goes_by_scans(scenario):
            return
        run, epoch, lidar = log.trajectory(), epoch_ns(log.run), scenario.sensors.scanner
        way = BelievedWay.of(run.time[: len(run.estimate)], run.estimate)
        by_scan = scenario.estimation.obstacles.source == "lidar"
        for message in log.messages("/scan", *(("/detections", "/people/estimate") if by_scan else ())):
            time = 1e-9 * message.time_ns
            if message.topic == "/scan":
                self._scans[time] = scan_points(ShownScan.of(message.value, scenario, epoch), lidar, way)
            elif message.topic == "/detections":
                self._detections[time] = _rows(
                    3, ([*one["position"], one["radius"]] for one in message.value["detections"])
                )
            else:
                self._tracks[time] = _rows(5, map(_track, message.value["people"]))

    def at(self, time: float) -> LidarView:
        """The latest of each at a time [s]; tracks have moved on at their velocities since."""
        (_, scan), (_, detections) = _latest(self._scans, time), _latest(self._detections, time)
        since, tracks = _latest(self._tracks, time)
        if tracks is None:
            return LidarView(scan, detections)
        moved = tracks[:, :4].copy()
        moved[:, :2] += (time - since) * moved[:, 2:]
        return LidarView(scan, detections, moved, tracks[:, 4] > self._seen)


def _rows(columns: int, rows: Any) -> Array:
    return np.array([*rows], float).reshape(-1, columns)


def _track(document: Mapping[str, Any]) -> list[float]:
    return [*document["position"], *document["velocity"], document.get("unseen", 0.0)]


def _latest(moments: Mapping[float, Array], time: float) -> tuple[float, Array | None]:
    """The latest of moments in order, and when it was."""
    times = [*moments]
    place = bisect_right(times, time + _SAME)
    return (times[place - 1], moments[times[place - 1]]) if place else (0.0, None)
