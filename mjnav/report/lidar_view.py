"""For pictures and films: what a robot sees by its lidar, believes and plans at each moment.

`scan_points` places a scan as the robot did: by the pose that it believed when each beam was taken.
"""

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from mjnav.errors import DamagedLogError
from mjnav.log.encode.plan import decode_plan
from mjnav.log.read.log import Log
from mjnav.messages import Array, PlanShown
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
    def of(cls, message: Any, scenario: Scenario) -> "ShownScan":
        """Of a foxglove.LaserScan."""
        ranges, noise = np.array(message.ranges, float), range_noise(scenario)
        if noise is not None:
            ranges = ranges - scenario.sensors.scanner.known_bias(ranges, noise)
        return cls(1e-9 * message.timestamp.ToNanoseconds(), ranges)


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


class LoggedViews:
    """What a robot saw, believed and planned at every moment of a log.

    Raises DamagedLogError where a plan is not as mjnav writes it.
    """

    def __init__(self, log: Log):
        scenario = log.scenario()
        self._period = scenario.control.period
        self._seen = scenario.sensors.longest_pause - _SAME  # [s] that a track may be unseen between two scans
        self._moments: dict[str, dict[float, Any]] = {"/plan": {}}  # by topic and time [s]
        if goes_by_scans(scenario):
            by_scan = scenario.estimation.obstacles.source == "lidar"
            topics = ("/scan", "/detections", "/people/estimate") if by_scan else ("/scan",)
            self._moments |= {topic: {} for topic in topics}
        run = log.trajectory()
        way = BelievedWay.of(run.time[: len(run.estimate)], run.estimate)
        for message in log.messages(*self._moments):
            value = message.value
            if message.topic == "/plan":
                value = _decoded(log, value)
            elif message.topic == "/scan":
                value = scan_points(ShownScan.of(value, scenario), scenario.sensors.scanner, way)
            elif message.topic == "/detections":
                value = _rows(3, ([*one["position"], one["radius"]] for one in value["detections"]))
            else:
                people = value["people"]
                value = _rows(5, ([*one["position"], *one["velocity"], one.get("unseen", 0.0)] for one in people))
            self._moments[message.topic][1e-9 * message.time_ns] = value

    def at(self, time: float) -> dict[str, Any]:
        """The latest of each at a time [s], as `world.render.Renderer.draw` takes it.

        Tracks have moved on at their velocities since; a plan holds for a period.
        """
        latest = {topic: (since, value) for topic in self._moments for since, value in self._latest(topic, time)}
        drawn = {topic[1:]: latest[topic][1] for topic in ("/scan", "/detections") if topic in latest}
        if "/people/estimate" in latest:
            since, tracks = latest["/people/estimate"]
            moved = tracks[:, :4].copy()
            moved[:, :2] += (time - since) * moved[:, 2:]
            drawn |= {"tracks": moved, "coasts": tracks[:, 4] > self._seen}
        since, plan = latest.get("/plan", (-np.inf, None))
        if plan is not None and time - since <= self._period + _SAME:
            drawn |= {"plan": plan.path, "fan": plan.fan, "feasible": plan.feasible}
        return drawn

    def _latest(self, topic: str, time: float) -> Iterator[tuple[float, Any]]:
        """The latest moment of a topic and its time; nothing before the first."""
        times = [*self._moments[topic]]
        if place := bisect_right(times, time + _SAME):
            yield times[place - 1], self._moments[topic][times[place - 1]]


def _rows(columns: int, rows: Any) -> Array:
    return np.array([*rows], float).reshape(-1, columns)


def _decoded(log: Log, message: Any) -> PlanShown:
    try:
        return decode_plan(message)
    except ValueError as error:
        raise DamagedLogError(f"{log.path}: damaged: /plan holds {error}") from error
