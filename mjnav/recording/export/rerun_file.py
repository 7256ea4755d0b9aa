"""Exports a log as a recording for the rerun viewer: one .rrd file with the timeline `sim_time` [s].

`world` holds the scene, the robot and the people as they are and as they are believed to be, all particles, the scan at
the believed pose, and the chosen arc; `plots` holds scalars, such as the robot's clearance from its surroundings; `log`
holds the status of the decisions and the events. Points are single precision.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import atan2, hypot
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import rerun as rr
from foxglove_schemas_protobuf.Log_pb2 import Log as Event
from numpy.typing import NDArray

from mjnav.geometry.distances import ellipse_95, placed, segment_distance
from mjnav.messages import Array
from mjnav.motion.unicycle import LIDAR_HEIGHT, integrate
from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.encode.plan import decode_plan
from mjnav.recording.encode.scene import PERSON_HEIGHT, ROBOT_HEIGHT, TABLE_TOP
from mjnav.recording.read.log import Log, LogMessage
from mjnav.scenarios.spec import Scenario

# ------------------------------------------------------------------------ scene, bodies and clearance


_GREY, _WOOD, _GREEN = (140, 145, 153), (166, 115, 64), (38, 191, 77, 150)
_BLUE, _GHOST, _RED = (38, 102, 230), (32, 96, 255, 120), (230, 90, 64)


def about_z(heading: float) -> rr.Quaternion:
    """The turn by `heading` [rad]."""
    return rr.Quaternion(xyzw=[0.0, 0.0, np.sin(0.5 * heading), np.cos(0.5 * heading)])


def log_scene(stream: rr.RecordingStream, scenario: Scenario) -> None:
    """Walls, tables, pillars and goals, for all times."""
    walls = scenario.walls
    if walls:
        ends = [(np.array(wall.start), np.array(wall.end), wall) for wall in walls]
        boxes = rr.Boxes3D(
            centers=[[*(0.5 * (a + b)), 0.5 * wall.height] for a, b, wall in ends],
            half_sizes=[[0.5 * hypot(*(b - a)), 0.5 * wall.thickness, 0.5 * wall.height] for a, b, wall in ends],
            quaternions=[about_z(atan2(*(b - a)[::-1])) for a, b, wall in ends],
            colors=[_GREY] * len(walls),
        )
        stream.log("world/walls", boxes, static=True)
    for i, table in enumerate(scenario.tables):
        leg_height = table.height - TABLE_TOP
        legs = rr.Cylinders3D(
            lengths=[leg_height] * 4,
            radii=[table.leg_radius] * 4,
            centers=[[*leg, 0.5 * leg_height] for leg in table.legs.tolist()],
            colors=[_WOOD] * 4,
        )
        top = rr.Boxes3D(
            centers=[[*table.position, table.height - 0.5 * TABLE_TOP]],
            half_sizes=[[*(0.5 * side + table.leg_radius for side in table.size), 0.5 * TABLE_TOP]],
            quaternions=[about_z(table.yaw)],
            colors=[_WOOD],
        )
        stream.log(f"world/tables/table{i}/legs", legs, static=True)
        stream.log(f"world/tables/table{i}/top", top, static=True)
    for i, pillar in enumerate(scenario.pillars):
        centre = [*pillar.position, 0.5 * pillar.height]
        shape = rr.Cylinders3D(lengths=[pillar.height], radii=[pillar.radius], centers=[centre], colors=[_GREY])
        stream.log(f"world/pillars/pillar{i}", shape, static=True)
    robot = scenario.robot
    goals = rr.Cylinders3D(
        lengths=[0.02] * len(robot.route),
        radii=[robot.goal_tolerance] * len(robot.route),
        centers=[[x, y, 0.01] for x, y in robot.route],
        colors=[_GREEN] * len(robot.route),
    )
    stream.log("world/goal", goals, static=True)


def log_bodies(stream: rr.RecordingStream, scenario: Scenario) -> None:
    """The robot, where it is and where it believes to be, and the people: shapes that their poses move."""
    radius = scenario.robot.radius
    for name, color in (("truth", _BLUE), ("estimate", _GHOST)):
        centre = [0.0, 0.0, 0.5 * ROBOT_HEIGHT]
        body = rr.Cylinders3D(lengths=[ROBOT_HEIGHT], radii=[radius], centers=[centre], colors=[color])
        stream.log(f"world/robot/{name}", body, static=True)
    for i, person in enumerate(scenario.people):
        body = rr.Cylinders3D(
            lengths=[PERSON_HEIGHT],
            radii=[person.radius],
            centers=[[0.0, 0.0, 0.5 * PERSON_HEIGHT]],
            colors=[_RED],
            labels=[f"person{i}"],
        )
        stream.log(f"world/people/person{i}", body, static=True)


def clearance(scenario: Scenario, robot: Array, people: Sequence[Array]) -> Array:
    """Distance from the robot's surface to the nearest other one at each moment [m], (T,); inf in an empty room.

    `robot` is (T, 3), and each of `people` (T, 2) or more columns, of which the first two count.
    """
    places = robot[:, :2]
    nearest = np.full(len(places), np.inf)
    for person, found in zip(scenario.people, people, strict=True):
        nearest = np.fmin(nearest, np.hypot(*(places - found[:, :2]).T) - person.radius)  # NaN: not there
    discs = [(leg, table.leg_radius) for table in scenario.tables for leg in table.legs]
    discs += [(np.array(pillar.position), pillar.radius) for pillar in scenario.pillars]
    for centre, radius in discs:
        nearest = np.minimum(nearest, np.hypot(*(places - centre).T) - radius)
    for wall in scenario.walls:
        corners = _corners(np.array(wall.start), np.array(wall.end), wall.thickness)
        edges = [segment_distance(places, corners[i], corners[(i + 1) % 4]) for i in range(4)]
        nearest = np.minimum(nearest, np.min(edges, axis=0))
    return nearest - scenario.robot.radius


def _corners(start: Array, end: Array, thickness: float) -> Array:
    """Of a wall, (4, 2), in order."""
    along = (end - start) / hypot(*(end - start))
    across = 0.5 * thickness * np.array([-along[1], along[0]])
    return np.array([start + across, end + across, end - across, start - across])


# ------------------------------------------------------------------------------------------ recording


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
