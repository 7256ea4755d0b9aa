"""What a robot that goes by its lidar sees and believes of people, from moment to moment, for pictures and films."""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.recording.log_format import epoch_ns
from mjnav.recording.read.log import Log
from mjnav.report.scans import BelievedWay, ShownScan, goes_by_scans, scan_points

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
