"""The tables of each topic: their columns with types and units, and the rows that one message gives."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log as Event

from mjnav.messages import PHASES
from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.encode.plan import decode_plan
from mjnav.recording.read.scene_rows import lines, pose_figures, solids

Rows = Iterable[Sequence[Any]]


@dataclass(frozen=True, slots=True)
class Column:
    """The type of a column's values (float64, float32, int64, bool or string), and their unit."""

    type: str
    unit: str = ""


Columns = Mapping[str, Column]


@dataclass(frozen=True, slots=True)
class Table:
    """A table's name, the columns that follow those of FIRST, and the rows of one message in these columns."""

    name: str
    own_columns: Columns
    rows: Callable[[Any], Rows]

    @property
    def columns(self) -> Columns:
        """All columns; every table begins with those by which tables are joined."""
        return {**FIRST, **self.own_columns}


# --------------------------------------------------------------------------------------------- columns

_TEXT, _FLAG, _NUMBER, _PURE = Column("string"), Column("bool"), Column("int64"), Column("float64")
FIRST: Columns = MappingProxyType({"tick": _NUMBER, "time": Column("float64", "s")})


def _in(unit: str, *names: str) -> dict[str, Column]:
    """Columns of numbers in this unit."""
    return dict.fromkeys(names, Column("float64", unit))


def _single(columns: Columns) -> dict[str, Column]:
    """The same columns in single precision, as the log has them."""
    return {name: replace(column, type="float32") for name, column in columns.items()}


_TWIST = {**_in("m/s", "v"), **_in("rad/s", "omega")}
_PLANAR = {**_in("m", "x", "y"), **_in("rad", "theta")}
_POINT = _in("m", "x", "y", "z")
_POSE = {**_POINT, **_in("", "qx", "qy", "qz", "qw")}
_COLOR = _in("", "red", "green", "blue", "alpha")
_STATE = {**_in("m", "x", "y"), **_in("m/s", "vx", "vy")}
_BELIEF = {"ess": _PURE, "recovered": _FLAG}


def _prefixed(prefix: str, columns: Columns) -> dict[str, Column]:
    return {f"{prefix}_{name}": column for name, column in columns.items()}


def _covariance(columns: Columns) -> dict[str, Column]:
    """Every entry of the matrix, row by row."""
    units = {name: column.unit for name, column in columns.items()}
    return {f"covariance_{a}_{b}": Column("float64", f"{units[a]}*{units[b]}") for a in units for b in units}


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


def _tracks(document: Mapping) -> Rows:
    for track in document["people"]:
        yield _flat(*(track[key] for key in _TRACK_KEYS), track.get("age"), track.get("unseen"))


def _odometry(document: Mapping) -> Rows:
    integrated = document.get("odometry_pose", [None] * len(_PLANAR))  # older logs do not have it
    yield _flat(*(document[key] for key in ("time", "interval", "v", "omega", "gyro", "pose")), integrated)


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
        for value in _float32(getattr(cone, kind)):
            yield cone.obstacle, cone.safe_share, kind, value


def _float32(values: Any) -> list[float]:
    """As they are in single precision."""
    return np.array(values, "<f4").tolist()


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


def _plan(message: Any) -> Rows:
    """A row a step; `ahead` is its time after the decision takes effect."""
    plan = decode_plan(message)
    for number, place in enumerate(plan.path.tolist(), start=1):
        yield number * plan.step, *place, plan.feasible


def _plan_fan(message: Any) -> Rows:
    """A row a step of each rollout."""
    plan = decode_plan(message)
    for rollout, (cost, path) in enumerate(zip(_float32(plan.fan_cost), plan.fan.tolist(), strict=True)):
        for number, place in enumerate(path, start=1):
            yield rollout, cost, number * plan.step, *place


def _plan_violation(message: Any) -> Rows:
    return enumerate(_float32(message.violation))


def _particles(cloud: Any) -> Rows:
    """The track's number is a whole one."""
    columns = decode_particles(cloud)
    numbers = [values.astype(int).tolist() if name == "track" else _float32(values) for name, values in columns.items()]
    return zip(*numbers, strict=True)


def _scan(scan: Any) -> Rows:
    step = (scan.end_angle - scan.start_angle) / max(1, len(scan.ranges) - 1)
    for beam, distance in enumerate(scan.ranges):
        yield beam, scan.start_angle + beam * step, distance


def _placed(message: Any) -> Rows:
    yield message.frame_id, *pose_figures(message.pose.position, message.pose.orientation)


def _transforms(message: Any) -> Rows:
    for transform in message.transforms:
        moved = pose_figures(transform.translation, transform.rotation)
        yield transform.parent_frame_id, transform.child_frame_id, *moved


def _event(event: Any) -> Rows:
    yield Event.Level.Name(event.level), event.name, event.message


# -------------------------------------------------------------------------------------------- the tables

_SOLID = {
    "entity": _TEXT,
    "shape": _TEXT,
    "number": _NUMBER,
    "frame": _TEXT,
    **_POSE,
    **_prefixed("size", _POINT),
    **_COLOR,
}
_LINE = {"entity": _TEXT, "line": _NUMBER, **_prefixed("from", _POINT), **_prefixed("to", _POINT), **_COLOR}
_TERMS = _in("", "goal", "lane_left", "lane_right", "total")
_CHOICES = {
    **_TWIST,
    "status": _TEXT,
    "advice": _TEXT,
    **_prefixed("nominal", _TWIST),
    **_prefixed("cost", _TERMS),
    **_prefixed("wish", _TWIST),
}
_ODOMETRY = {
    **_in("s", "measured", "interval"),
    **_TWIST,
    **_in("rad/s", "gyro"),
    **_PLANAR,
    **_prefixed("odometry", _PLANAR),
}
_TRACK = {"name": _TEXT, **_STATE, **_covariance(_STATE), **_in("m", "radius"), **_BELIEF, **_in("s", "age", "unseen")}
_TRACK_KEYS = ("name", "position", "velocity", "covariance", "radius", "ess", "recovered")
_PLACE = _in("m", "x", "y")
_DETECTION = {**_in("s", "measured"), **_PLACE, **_covariance(_PLACE), **_in("m", "radius"), "beams": _NUMBER}
_DETECTION_KEYS = ("time", "position", "covariance", "radius", "beams")
_CONTACT = {"kind": _TEXT, "name": _TEXT, **_in("N", "force"), **_in("s", "seen")}
_CANDIDATE = {"candidate": _NUMBER, **_TWIST, **_single(_TERMS), "role": _TEXT}
_CONE = {"obstacle": _TEXT, "safe_share": _PURE, "kind": _TEXT, "f": Column("float32")}
_CONE_COSTS = {"candidate": _NUMBER, "constraint": _NUMBER, "cost": Column("float32")}
_PARTICLES = _single({**_STATE, "weight": _PURE})
_WAY = {**_in("s", "ahead"), **_single(_PLACE)}
_POSES = {"frame": _TEXT, **_POSE}
_FRAMES = {"parent": _TEXT, "child": _TEXT, **_POSE}
_BEAMS = {"beam": _NUMBER, **_in("rad", "angle"), **_in("m", "range")}
_TIMING = {**{f"{phase}_ns": Column("int64", "ns") for phase in (*PHASES, "lateness")}, "deadline_missed": _FLAG}

# topic -> its tables
TABLES: Mapping[str, tuple[Table, ...]] = MappingProxyType(
    {
        "/robot/state": (Table("robot_state", {**_PLANAR, **_TWIST, **_ESTIMATE}, _state),),
        "/robot/truth": (Table("robot_truth", _POSES, _placed),),
        "/robot/estimate": (Table("robot_estimate", _POSES, _placed),),
        "/tf": (Table("tf", _FRAMES, _transforms),),
        "/people/truth": (
            Table("people_truth", {"name": _TEXT, **_STATE}, _each("people", "name", "position", "velocity")),
        ),
        "/people/estimate": (
            Table("people_estimate", _TRACK, _tracks),
            Table("people_detections", {"detection": _NUMBER, **_in("m", "x", "y")}, _detections),
        ),
        "/detections": (Table("detections", _DETECTION, _each("detections", *_DETECTION_KEYS)),),
        "/contacts": (Table("contacts", _CONTACT, _each("contacts", "kind", "name", "force", "time")),),
        "/odometry": (Table("odometry", _ODOMETRY, _odometry),),
        "/scan": (Table("scan", _BEAMS, _scan),),
        "/belief/robot": (Table("belief_robot", _single({**_PLANAR, "weight": _PURE}), _particles),),
        "/belief/obstacles": (Table("belief_obstacles", {**_PARTICLES, "track": _NUMBER}, _particles),),
        "/decision": (
            Table("decision", _CHOICES, _decision),
            Table("decision_cone", {"constraint": _NUMBER, "cost": _PURE}, _decision_cone),
        ),
        "/command": (Table("command", _TWIST, _row("v", "omega")),),
        "/cone": (Table("cone", _CONE, _cone),),
        "/candidates": (
            Table("candidates", _CANDIDATE, _candidates),
            Table("candidates_cone", _CONE_COSTS, _candidates_cone),
        ),
        "/candidates/arcs": (Table("candidates_arcs", _LINE, lines),),
        "/plan": (
            Table("plan", {**_WAY, "feasible": _FLAG}, _plan),
            Table("plan_fan", {"rollout": _NUMBER, "cost": Column("float32"), **_WAY}, _plan_fan),
            Table("plan_violation", {"sample": _NUMBER, "h": Column("float32")}, _plan_violation),
        ),
        "/scene": (Table("scene", _SOLID, solids), Table("scene_lines", _LINE, lines)),
        "/events": (Table("events", dict.fromkeys(("level", "name", "text"), _TEXT), _event),),
        "/tick": (Table("tick", _TIMING, _row(*_TIMING)),),
    }
)
