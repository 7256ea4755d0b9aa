"""The tables of a log: their columns with types and units, and the rows that the messages of each topic give.

`LogMessage` is one decoded message; `TopicSummary` is what is known of a topic once all of its messages were counted.

The shapes of a foxglove.SceneUpdate become rows of numbers: solids, and the segments of lines.

`TABLES` names the tables of each topic; a table gives the rows of one message.

`blocks` collects the rows, some thousand at a time. CSV files, Parquet files and data frames are made of these blocks.
"""

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import chain, pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log as Event

from mjnav.errors import DamagedLogError, unknown_name
from mjnav.log.encode.particles import decode_particles
from mjnav.log.encode.plan import decode_plan
from mjnav.log.read.records import EXPORT, FREE_EXPORT, Budget
from mjnav.log.read.ticks import NOT_OURS
from mjnav.messages import PHASES

# -------------------------------------------------------------------------------- messages and topics


class LogMessage(NamedTuple):
    """One decoded message: JSON as a dict, protobuf as its message object, anything else as bytes."""

    topic: str
    time_ns: int
    sequence: int  # the tick
    value: Any


@dataclass(slots=True)
class TopicSummary:
    """What one topic holds. Times are simulated nanoseconds; sequence numbers are ticks where mjnav wrote the log."""

    schema: str
    messages: int = 0
    first_ns: int | None = None
    last_ns: int | None = None
    max_gap_ns: int | None = None  # the longest time between two successive messages
    max_gap_at_ns: int | None = None  # when it began
    first_sequence: int | None = None
    last_sequence: int | None = None
    skipped: int = 0  # sequence numbers between those of successive messages
    bytes: int = 0  # of the messages, before compression

    @property
    def hz(self) -> float | None:
        """Messages a second over the topic's own span; None where they span no time."""
        if self.first_ns is None or self.last_ns is None or self.last_ns <= self.first_ns:
            return None
        return (self.messages - 1) / (1e-9 * (self.last_ns - self.first_ns))

    def add(self, time_ns: int, sequence: int, size: int) -> None:
        """Counts one more message."""
        self.messages += 1
        self.bytes += size
        if self.last_ns is None or self.last_sequence is None:
            self.first_ns, self.first_sequence = time_ns, sequence
        else:
            gap = time_ns - self.last_ns
            if self.max_gap_ns is None or gap > self.max_gap_ns:
                self.max_gap_ns, self.max_gap_at_ns = max(0, gap), self.last_ns
            if sequence > self.last_sequence + 1:
                self.skipped += sequence - self.last_sequence - 1
        self.last_ns, self.last_sequence = time_ns, sequence

    def shift(self, epoch: int) -> None:
        """Counts times from `epoch` [ns] on."""
        if self.first_ns is not None and self.last_ns is not None:
            self.first_ns, self.last_ns = self.first_ns - epoch, self.last_ns - epoch
        if self.max_gap_at_ns is not None:
            self.max_gap_at_ns -= epoch


# ---------------------------------------------------------------------------------- shapes of a scene


def pose_figures(position: Any, turn: Any) -> list[float]:
    """x, y, z of a point and of a quaternion, and its w."""
    return [position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w]


def _color(color: Any) -> list[float]:
    return [color.r, color.g, color.b, color.a]


def solids(update: Any) -> Iterator[tuple[Any, ...]]:
    """Boxes, cylinders and arrows; an arrow's size is its length and its head's diameter, twice."""
    for entity in update.entities:
        for shape, found in (("box", entity.cubes), ("cylinder", entity.cylinders), ("arrow", entity.arrows)):
            for number, solid in enumerate(found):
                if shape == "arrow":
                    size = [solid.shaft_length + solid.head_length, solid.head_diameter, solid.head_diameter]
                else:
                    size = [solid.size.x, solid.size.y, solid.size.z]
                placed = pose_figures(solid.pose.position, solid.pose.orientation)
                yield entity.id, shape, number, entity.frame_id, *placed, *size, *_color(solid.color)


def segments(line: Any) -> Iterator[tuple[Any, Any]]:
    """The two ends of each segment of a foxglove.LinePrimitive, in its own pose, one by one: few bytes may be many."""
    corners = (line.points[i] for i in line.indices) if line.indices else iter(line.points)
    if line.type == LinePrimitive.LINE_LIST:
        return zip(corners, corners, strict=True)
    if line.type == LinePrimitive.LINE_LOOP and (first := next(corners, None)) is not None:
        corners = chain((first,), corners, (first,))
    return pairwise(corners)


def lines(update: Any) -> Iterator[tuple[Any, ...]]:
    """A row a segment: entity, number of its line, both ends, colour."""
    for entity in update.entities:
        for number, line in enumerate(entity.lines):
            color, lift = _color(line.color), line.pose.position.z
            for a, b in segments(line):
                yield entity.id, number, a.x, a.y, a.z + lift, b.x, b.y, b.z + lift, *color


# ------------------------------------------------------------------------------------ form of a table


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


# ------------------------------------------------------------------------------------- blocks of rows


BLOCK = 16_384  # rows
_LONG_TEXT = 1 << 20  # characters, beyond which a block is smaller: every row may hold a long text of its own
_NUMBER_SIZE = 20  # [bytes] of a number


class Block(NamedTuple):
    """Rows of one table as columns, each a list with a value a row; a value that is missing is None."""

    table: Table
    columns: Sequence[Sequence[Any]]


class _Rows:
    """Rows of one table that wait to become a block."""

    def __init__(self, table: Table):
        self._table = table
        self._texts = [i for i, column in enumerate(table.columns.values()) if column.type == "string"]
        self._rows: list[tuple] = []
        self._characters = 0

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def full(self) -> bool:
        return len(self._rows) >= BLOCK or self._characters > _LONG_TEXT

    def add(self, row: tuple) -> None:
        """Raises ValueError for a row that has not a value for each column."""
        if len(row) != len(self._table.columns):
            raise ValueError(f"{self._table.name}: {len(row)} values for {len(self._table.columns)} columns")
        self._rows.append(row)
        self._characters += sum(len(row[i]) for i in self._texts if isinstance(row[i], str))

    def block(self, budget: Budget, path: Path) -> Block:
        """All rows, which are gone afterwards."""
        columns = list(zip(*self._rows, strict=True))
        numbers = len(self._rows) * (len(columns) - len(self._texts))
        if not budget.allows_export(self._characters + _NUMBER_SIZE * numbers):
            what = f"{FREE_EXPORT} bytes and {EXPORT} for each of the log's"
            raise DamagedLogError(f"{path}: damaged: its tables would take more than {what}")
        self._rows, self._characters = [], 0
        return Block(self._table, columns)


def blocks(path: Path, tables: Iterable[Table], messages: Iterable[LogMessage]) -> Iterator[Block]:
    """The rows that these messages of the log at `path` give in these tables, in their order.

    Raises DamagedLogError where they would take more room than a log of its size can fill, and what `not_ours` turns
    into a DamagedLogError where a message is not one of mjnav's.
    """
    budget = Budget(path.stat().st_size)
    waiting = {table.name: _Rows(table) for table in tables}
    chosen = {
        topic: [(table, waiting[table.name]) for table in found if table.name in waiting]
        for topic, found in TABLES.items()
    }
    for message in messages:
        first = (message.sequence, message.time_ns / 1e9)
        for table, rows in chosen[message.topic]:
            for row in table.rows(message.value):
                rows.add((*first, *row))
                if rows.full:
                    yield rows.block(budget, path)
    for rows in waiting.values():
        if rows:
            yield rows.block(budget, path)


@contextmanager
def not_ours(path: Path) -> Iterator[None]:
    """Turns what a message that mjnav did not write raises into a DamagedLogError of one line."""
    try:
        yield
    except DamagedLogError:
        raise
    except (*NOT_OURS, struct.error) as error:
        raise DamagedLogError(f"{path}: holds a message that is not one of mjnav's ({error!r})") from error


def find_table(name: str) -> tuple[str, Table]:
    """The topic and the table of this name; of a topic's name its first table. Raises InvalidValue with the nearest."""
    found = {table.name: (topic, table) for topic, tables in TABLES.items() for table in tables}
    found |= {topic: (topic, tables[0]) for topic, tables in TABLES.items()}
    if name not in found:
        raise unknown_name("table", name, found)
    return found[name]
