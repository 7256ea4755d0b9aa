"""A recording for the rerun viewer: one .rrd file with the timeline `sim_time` [s].

`world` holds the scene, the robot and the people as they are and as they are believed to be, all particles, the scan at
the believed pose, and the chosen arc; `plots` holds scalars; `log` the status of the decisions and the events. Points
are single precision.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import rerun as rr
from foxglove_schemas_protobuf.Log_pb2 import Log as Event
from numpy.typing import NDArray

from mjnav.geometry.beams import placed
from mjnav.geometry.ellipse import ellipse_95
from mjnav.messages import Array
from mjnav.motion.diff_drive import LIDAR_HEIGHT
from mjnav.motion.unicycle import integrate
from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.encode.plan import decode_plan
from mjnav.recording.export.rerun_scene import about_z, clearance, log_bodies, log_scene
from mjnav.recording.read.log import Log, LogMessage

TOPICS = (
    "/robot/state",
    "/people/truth",
    "/people/estimate",
    "/detections",
    "/scan",
    "/belief/robot",
    "/belief/obstacles",
    "/decision",
    "/command",
    "/cone",
    "/plan",
    "/events",
)
TIMELINE = "sim_time"
AHEAD = 1.0  # [s] that the chosen arc is drawn for
_SHARES = np.linspace(0.0, 1.0, 11)
_LEVELS = MappingProxyType({Event.INFO: "INFO", Event.WARNING: "WARN", Event.ERROR: "ERROR"})


class _Series:
    """What is logged at one entity path: times, and a value or a list of points a time."""

    def __init__(self):
        self.times: list[int] = []
        self.values: list[Any] = []

    def add(self, time_ns: int, value: Any) -> None:
        self.times.append(time_ns)
        self.values.append(value)


class _Collector:
    """The messages of a log, by entity path and kind."""

    def __init__(self, num_people: int, mount: Array):
        self.series: dict[tuple[str, str], _Series] = {}
        self._people = {f"person{i}" for i in range(num_people)}
        self._found = False  # whether there was a track without a person's name
        self._mount = mount  # of the lidar on the robot
        self._believed: list[float] | None = None
        self._status = ""

    def put(self, kind: str, path: str, time_ns: int, value: Any) -> None:
        self.series.setdefault((kind, path), _Series()).add(time_ns, value)

    def take(self, message: LogMessage) -> None:
        now, value = message.time_ns, message.value
        if message.topic == "/robot/state":
            self._state(now, value)
        elif message.topic == "/people/truth":
            for person in value["people"]:
                self.put("pose", f"world/people/{person['name']}", now, [*person["position"], 0.0])
        elif message.topic == "/people/estimate":
            self._tracks(now, value["people"])
        elif message.topic == "/detections":
            self.put("detections", "world/detections", now, [_disc(found) for found in value["detections"]])
            self.put("detections", "world/detections/regions", now, [_region(found) for found in value["detections"]])
        elif message.topic == "/belief/robot":
            self.put("points", "world/robot/particles", now, _places(value))
        elif message.topic == "/belief/obstacles":
            self.put("points", "world/tracks/particles", now, _places(value))
        elif message.topic == "/scan" and self._believed is not None:
            self.put("points", "world/scan", now, _hits(value, self._believed, self._mount))
        elif message.topic == "/decision":
            self._decision(now, value)
        elif message.topic == "/command":
            self.put("scalar", "plots/command/v", now, value["v"])
            self.put("scalar", "plots/command/omega", now, value["omega"])
        elif message.topic == "/cone":
            self.put("scalar", "plots/safe_share", now, value.safe_share)
        elif message.topic == "/plan":
            self.put("strip", "world/plan", now, _lifted(decode_plan(value).path, 0.04))
        elif message.topic == "/events":
            self.put("text", "log/events", now, (f"{value.name}: {value.message}", _LEVELS.get(value.level, "DEBUG")))

    def _tracks(self, now: int, tracks: Sequence[Mapping[str, Any]]) -> None:
        """An entity each where tracks carry people's names; one for all of those that come and go."""
        states = {track["name"]: np.array([*track["position"], *track["velocity"]], float) for track in tracks}
        for name in self._people & states.keys():
            self.put("arrow", f"world/tracks/{name}", now, states.pop(name))
        if states or self._found:
            self._found = True
            self.put("arrows", "world/tracks/found", now, states)

    def _state(self, now: int, value: Mapping[str, Any]) -> None:
        self.put("pose", "world/robot/truth", now, value["pose"])
        self.put("scalar", "plots/robot/v", now, value["twist"][0])
        self.put("scalar", "plots/robot/omega", now, value["twist"][1])
        if value["estimate"] is not None:
            self._believed = value["estimate"]["mean"]
            self.put("pose", "world/robot/estimate", now, self._believed)

    def _decision(self, now: int, value: Mapping[str, Any]) -> None:
        if self._believed is not None:
            start = np.array(self._believed, float)
            arc = np.stack([integrate(start, value["v"], value["omega"], AHEAD * share) for share in _SHARES])
            self.put("strip", "world/chosen_arc", now, _lifted(arc[:, :2], 0.03))
        if value["status"] != self._status:
            self._status = value["status"]
            self.put("text", "log/status", now, (f"{value['status']} {value['advice']}".strip(), "INFO"))


def _lifted(points: Array, height: float) -> NDArray[np.float32]:
    """Points (n, 2) at a height, (n, 3), single precision."""
    return np.insert(points, 2, height, axis=1).astype(np.float32)


def _disc(found: Mapping[str, Any]) -> list[float]:
    """A detected body: x, y, semi-axes, direction."""
    return [*found["position"], found["radius"], found["radius"], 0.0]


def _region(found: Mapping[str, Any]) -> list[float]:
    """The 95 % region of its centre."""
    return [*found["position"], *ellipse_95(found["covariance"])]


def _places(cloud: Any) -> NDArray[np.float32]:
    columns = decode_particles(cloud)
    return _lifted(np.stack([columns["x"], columns["y"]], axis=-1), 0.02)


def _hits(scan: Any, believed: Sequence[float], mount: Array) -> NDArray[np.float32]:
    """Where the beams that met something end, as if all were taken at the believed pose."""
    x, y, heading = placed(np.array(believed, float), mount)
    ranges = np.array(scan.ranges, float)
    angles = heading + np.linspace(scan.start_angle, scan.end_angle, len(ranges))
    ends = np.stack([x + ranges * np.cos(angles), y + ranges * np.sin(angles)], axis=-1)
    return _lifted(ends[np.isfinite(ranges)], LIDAR_HEIGHT)


def _rows(values: Sequence[Any]) -> Array:
    """Values as rows of numbers, NaN for null."""
    return np.array(values, float)


# ------------------------------------------------------------------------------------- kinds of columns


def _pose(values: Sequence[Any]) -> Any:
    poses = _rows(values)
    places = _lifted(poses[:, :2], 0.0)
    return rr.Transform3D.columns(translation=places, quaternion=[about_z(heading) for heading in poses[:, 2]])


def _arrow(values: Sequence[Any]) -> Any:
    states = _rows(values)
    return rr.Arrows3D.columns(origins=_lifted(states[:, :2], 0.05), vectors=_lifted(states[:, 2:], 0.0))


def _arrows(values: Sequence[Mapping[str, Array]]) -> Any:
    states = np.array([state for tracks in values for state in tracks.values()]).reshape(-1, 4)
    labels = [name for tracks in values for name in tracks]
    lengths = [len(tracks) for tracks in values]
    arrows = rr.Arrows3D.columns(
        origins=_lifted(states[:, :2], 0.05), vectors=_lifted(states[:, 2:], 0.0), labels=labels
    )
    return arrows.partition(lengths)


def _detections(values: Sequence[Sequence[Sequence[float]]]) -> Any:
    """Flat ellipses of x, y, two semi-axes and the first one's direction each."""
    rows = np.array([row for found in values for row in found], float).reshape(-1, 5)
    ellipses = rr.Ellipsoids3D.columns(
        centers=_lifted(rows[:, :2], 0.05),
        half_sizes=_lifted(rows[:, 2:4], 0.01),
        quaternions=[about_z(direction) for direction in rows[:, 4]],
    )
    return ellipses.partition([len(found) for found in values])


def _points(values: Sequence[Any]) -> Any:
    points = np.concatenate(values)
    return rr.Points3D.columns(positions=points).partition([len(rows) for rows in values])


def _strip(values: Sequence[Any]) -> Any:
    return rr.LineStrips3D.columns(strips=values)


def _scalar(values: Sequence[Any]) -> Any:
    return rr.Scalars.columns(scalars=_rows(values))


def _text(values: Sequence[Any]) -> Any:
    return rr.TextLog.columns(text=[text for text, _ in values], level=[level for _, level in values])


_COLUMNS: Mapping[str, Callable[[Sequence[Any]], Any]] = MappingProxyType(
    {
        "pose": _pose,
        "arrow": _arrow,
        "arrows": _arrows,
        "detections": _detections,
        "points": _points,
        "strip": _strip,
        "scalar": _scalar,
        "text": _text,
    }
)


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], path: Path) -> dict[str, int]:
    """Writes the file; gives the number of rows at each entity path that changes over time."""
    scenario = log.scenario()
    collector = _Collector(len(scenario.people), scenario.sensors.scanner.mount)
    for message in messages:
        collector.take(message)
    truth = collector.series.get(("pose", "world/robot/truth"))
    if truth is not None:
        found = [collector.series.get(("pose", f"world/people/person{i}")) for i in range(len(scenario.people))]
        people = [_rows(one.values) for one in found if one is not None and one.times == truth.times]
        if len(people) == len(found):  # a damaged log may lack some
            for now, value in zip(truth.times, clearance(scenario, _rows(truth.values), people).tolist(), strict=True):
                collector.put("scalar", "plots/clearance", now, value)
    run = log.run or {}
    name = f"{run.get('scene', '')} {run.get('controller', '')} {run.get('seed', '')} {log.path.stem}"
    with rr.RecordingStream("mjnav", recording_id=name, send_properties=False) as stream:
        stream.save(path)
        log_scene(stream, scenario)
        log_bodies(stream, scenario)
        for (kind, entity), series in collector.series.items():
            times = rr.TimeColumn(TIMELINE, duration=np.array(series.times, "timedelta64[ns]"))
            stream.send_columns(entity, indexes=[times], columns=_COLUMNS[kind](series.values))
        stream.flush()
    stream.disconnect()
    return {entity: len(series.times) for (_, entity), series in collector.series.items()}
