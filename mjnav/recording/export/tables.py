"""The CSV tables of each topic: their columns with units, and the rows that one message gives."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log as Event

from mjnav.messages import PHASES
from mjnav.recording.encode.particles import decode_particles

Rows = Iterable[Sequence[Any]]


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A file's name without suffix, its columns with their units, and the rows of one message without tick and time."""

    name: str
    columns: Mapping[str, str]
    rows: Callable[[Any], Rows]


# --------------------------------------------------------------------------------------------- columns

_TWIST = {"v": "m/s", "omega": "rad/s"}
_PLANAR = {"x": "m", "y": "m", "theta": "rad"}
_POINT = {"x": "m", "y": "m", "z": "m"}
_POSE = {**_POINT, "qx": "", "qy": "", "qz": "", "qw": ""}
_COLOR = {"red": "", "green": "", "blue": "", "alpha": ""}
_STATE = {"x": "m", "y": "m", "vx": "m/s", "vy": "m/s"}
_BELIEF = {"ess": "", "recovered": ""}


def _prefixed(prefix: str, columns: Mapping[str, str]) -> dict[str, str]:
    return {f"{prefix}_{name}": unit for name, unit in columns.items()}


def _covariance(columns: Mapping[str, str]) -> dict[str, str]:
    """Every entry of the matrix, row by row."""
    return {f"covariance_{a}_{b}": f"{columns[a]}*{columns[b]}" for a in columns for b in columns}


_ESTIMATE = _prefixed("estimate", {**_PLANAR, **_covariance(_PLANAR), **_BELIEF})


# ------------------------------------------------------------------------------------------------ rows


def _flat(*parts: Any) -> list[Any]:
    """The scalars of nested lists, in order."""
    return [scalar for part in parts for scalar in (_flat(*part) if isinstance(part, list) else [part])]


def _row(*keys: str) -> Callable[[Mapping], Rows]:
    """One row a document, of the values of these keys."""
    return lambda document: [_flat(*(document[key] for key in keys))]


def _each(name: str, *keys: str) -> Callable[[Mapping], Rows]:
    """A row for each object in the list of this name."""
    return lambda document: (_flat(*(item[key] for key in keys)) for item in document[name])


def _state(document: Mapping) -> Rows:
    believed = document["estimate"]
    if believed is None:
        estimate = [None] * len(_ESTIMATE)
    else:
        estimate = [believed[key] for key in ("mean", "covariance", "ess", "recovered")]
    yield _flat(document["pose"], document["twist"], estimate)


def _detections(document: Mapping) -> Rows:
    for number, position in enumerate(document.get("detections", ())):
        yield _flat(number, position)


def _decision(document: Mapping) -> Rows:
    nominal, cost = document["nominal"] or {}, document["cost"] or {}
    wish = document.get("wish") or {}
    yield [
        *(document[key] for key in ("v", "omega", "status", "advice")),
        nominal.get("v"),
        nominal.get("omega"),
        cost.get("goal"),
        *cost.get("lane", (None, None)),
        cost.get("total"),
        wish.get("v"),
        wish.get("omega"),
    ]


def _decision_cone(document: Mapping) -> Rows:
    return enumerate((document["cost"] or {}).get("cone", ()))


def _cone(cone: Any) -> Rows:
    for kind in ("samples", "desired"):
        for text in _float32(getattr(cone, kind)):
            yield cone.obstacle, cone.safe_share, kind, text


def _float32(values: Any) -> list[str]:
    """As text, the shortest that reads back as the same float32."""
    return np.array(values, "<f4").astype("U").tolist()


def _candidates(message: Any) -> Rows:
    terms = (_float32(getattr(message, name)) for name in ("goal", "lane_left", "lane_right", "total"))
    for number, row in enumerate(zip(message.v, message.omega, *terms, strict=True)):
        roles = [name for name in ("nominal", "chosen") if getattr(message, name) == number]
        yield number, *row, " ".join(roles)


def _candidates_cone(message: Any) -> Rows:
    """Of the constraints that cost any candidate something."""
    for constraint, column in enumerate(message.cone):
        for number, cost in enumerate(_float32(column.values)):
            yield number, constraint, cost


def _particles(cloud: Any) -> Rows:
    """As text, which is that of float32; the track's number is a whole one."""
    columns = decode_particles(cloud)
    texts = [values.astype(int).tolist() if name == "track" else _float32(values) for name, values in columns.items()]
    return zip(*texts, strict=True)


def _scan(scan: Any) -> Rows:
    step = (scan.end_angle - scan.start_angle) / max(1, len(scan.ranges) - 1)
    for beam, distance in enumerate(scan.ranges):
        yield beam, scan.start_angle + beam * step, distance


def _pose_figures(position: Any, turn: Any) -> list[float]:
    return [position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w]


def _placed(message: Any) -> Rows:
    yield message.frame_id, *_pose_figures(message.pose.position, message.pose.orientation)


def _transforms(message: Any) -> Rows:
    for transform in message.transforms:
        moved = _pose_figures(transform.translation, transform.rotation)
        yield transform.parent_frame_id, transform.child_frame_id, *moved


def _color(color: Any) -> list[float]:
    return [color.r, color.g, color.b, color.a]


def _solids(update: Any) -> Rows:
    """Boxes, cylinders and arrows; an arrow's size is its length and its head's diameter, twice."""
    for entity in update.entities:
        for shape, solids in (("box", entity.cubes), ("cylinder", entity.cylinders), ("arrow", entity.arrows)):
            for number, solid in enumerate(solids):
                if shape == "arrow":
                    size = [solid.shaft_length + solid.head_length, solid.head_diameter, solid.head_diameter]
                else:
                    size = [solid.size.x, solid.size.y, solid.size.z]
                placed = _pose_figures(solid.pose.position, solid.pose.orientation)
                yield entity.id, shape, number, entity.frame_id, *placed, *size, *_color(solid.color)


def segments(line: Any) -> Iterator[tuple[Any, Any]]:
    """The two ends of each segment of a foxglove.LinePrimitive, in its own pose, one by one: few bytes may be many."""
    corners = (line.points[i] for i in line.indices) if line.indices else iter(line.points)
    if line.type == LinePrimitive.LINE_LIST:
        return zip(corners, corners, strict=True)
    if line.type == LinePrimitive.LINE_LOOP and (first := next(corners, None)) is not None:
        corners = chain((first,), corners, (first,))
    return pairwise(corners)


def _lines(update: Any) -> Rows:
    for entity in update.entities:
        for number, line in enumerate(entity.lines):
            color, lift = _color(line.color), line.pose.position.z
            for a, b in segments(line):
                yield entity.id, number, a.x, a.y, a.z + lift, b.x, b.y, b.z + lift, *color


def _event(event: Any) -> Rows:
    yield Event.Level.Name(event.level), event.name, event.message


# -------------------------------------------------------------------------------------------- the tables

_SOLID = {"entity": "", "shape": "", "number": "", "frame": "", **_POSE, **_prefixed("size", _POINT), **_COLOR}
_LINE = {"entity": "", "line": "", **_prefixed("from", _POINT), **_prefixed("to", _POINT), **_COLOR}
_COSTS = _prefixed("cost", {"goal": "", "lane_left": "", "lane_right": "", "total": ""})
_CHOICES = {**_TWIST, "status": "", "advice": "", **_prefixed("nominal", _TWIST), **_COSTS, **_prefixed("wish", _TWIST)}

_ODOMETRY = {"measured": "s", "interval": "s", **_TWIST, "gyro": "rad/s", **_PLANAR}
_TRACK = {"name": "", **_STATE, **_covariance(_STATE), "radius": "m", **_BELIEF}
_TRACK_KEYS = ("name", "position", "velocity", "covariance", "radius", "ess", "recovered")
_CONTACT = {"kind": "", "name": "", "force": "N", "seen": "s"}
_CANDIDATE = {"candidate": "", **_TWIST, "goal": "", "lane_left": "", "lane_right": "", "total": "", "role": ""}
_TIMING = {**{f"{phase}_ns": "ns" for phase in (*PHASES, "lateness")}, "deadline_missed": ""}

# topic -> its tables
TABLES: Mapping[str, tuple[CsvTable, ...]] = MappingProxyType(
    {
        "/robot/state": (CsvTable("robot_state", {**_PLANAR, **_TWIST, **_ESTIMATE}, _state),),
        "/robot/truth": (CsvTable("robot_truth", {"frame": "", **_POSE}, _placed),),
        "/robot/estimate": (CsvTable("robot_estimate", {"frame": "", **_POSE}, _placed),),
        "/tf": (CsvTable("tf", {"parent": "", "child": "", **_POSE}, _transforms),),
        "/people/truth": (
            CsvTable("people_truth", {"name": "", **_STATE}, _each("people", "name", "position", "velocity")),
        ),
        "/people/estimate": (
            CsvTable("people_estimate", _TRACK, _each("people", *_TRACK_KEYS)),
            CsvTable("people_detections", {"detection": "", "x": "m", "y": "m"}, _detections),
        ),
        "/contacts": (CsvTable("contacts", _CONTACT, _each("contacts", "kind", "name", "force", "time")),),
        "/odometry": (CsvTable("odometry", _ODOMETRY, _row("time", "interval", "v", "omega", "gyro", "pose")),),
        "/scan": (CsvTable("scan", {"beam": "", "angle": "rad", "range": "m"}, _scan),),
        "/belief/robot": (CsvTable("belief_robot", {**_PLANAR, "weight": ""}, _particles),),
        "/belief/obstacles": (CsvTable("belief_obstacles", {**_STATE, "weight": "", "track": ""}, _particles),),
        "/decision": (
            CsvTable("decision", _CHOICES, _decision),
            CsvTable("decision_cone", {"constraint": "", "cost": ""}, _decision_cone),
        ),
        "/command": (CsvTable("command", _TWIST, _row("v", "omega")),),
        "/cone": (CsvTable("cone", {"obstacle": "", "safe_share": "", "kind": "", "f": ""}, _cone),),
        "/candidates": (
            CsvTable("candidates", _CANDIDATE, _candidates),
            CsvTable("candidates_cone", {"candidate": "", "constraint": "", "cost": ""}, _candidates_cone),
        ),
        "/candidates/arcs": (CsvTable("candidates_arcs", _LINE, _lines),),
        "/scene": (CsvTable("scene", _SOLID, _solids), CsvTable("scene_lines", _LINE, _lines)),
        "/events": (CsvTable("events", {"level": "", "name": "", "text": ""}, _event),),
        "/tick": (CsvTable("tick", _TIMING, _row(*_TIMING)),),
    }
)
