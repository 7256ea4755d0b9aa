"""The tables of a log: their columns with types and units, and the rows that the messages of each topic give.

`TABLES` names the tables of each topic; a topic that only draws what others say has none. A topic of JSON documents
says only which keys its columns are; a table of another topic has a function that gives the rows of one message.

`blocks` collects the rows, some thousand at a time. CSV files, Parquet files and data frames are made of these blocks.
"""

import json
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log as Event

from mjnav.errors import DamagedLogError, of_extra, unknown_name
from mjnav.log.encode.particles import decode_particles
from mjnav.log.encode.plan import decode_plan
from mjnav.log.read.records import EXPORT, FREE_EXPORT, Budget
from mjnav.log.read.ticks import NOT_OURS
from mjnav.messages import PHASES

if TYPE_CHECKING:
    import pyarrow
    from pandas import DataFrame


class LogMessage(NamedTuple):
    """One decoded message: JSON as a dict, protobuf as its message object, anything else as bytes."""

    topic: str
    time_ns: int
    sequence: int  # the tick
    value: Any


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


_TEXT, _FLAG, _NUMBER, _SINGLE = (Column(kind) for kind in ("string", "bool", "int64", "float32"))
_PURE, _S, _M, _RAD, _M_S, _RAD_S, _N = (Column("float64", unit) for unit in ("", "s", "m", "rad", "m/s", "rad/s", "N"))
FIRST: Columns = MappingProxyType({"tick": _NUMBER, "time": _S})


def _single(columns: Columns) -> dict[str, Column]:
    """The same columns in single precision, as the log has them."""
    return {name: replace(column, type="float32") for name, column in columns.items()}


def _prefixed(prefix: str, columns: Columns) -> dict[str, Column]:
    return {f"{prefix}_{name}": column for name, column in columns.items()}


def _covariance(columns: Columns) -> dict[str, Column]:
    """Every entry of the matrix, row by row."""
    units = {name: column.unit for name, column in columns.items()}
    return {f"covariance_{a}_{b}": Column("float64", f"{units[a]}*{units[b]}") for a in units for b in units}


_OPTIONAL = ("age", "unseen", "radius", "wish")  # keys


def _documents(name: str, fields: Mapping[str, Column | Columns], each: str | None = None) -> Table:
    """A table with a row for each JSON document, or for each object in the document's list `each`.

    `fields` has the columns by the key of their values, as "estimate.mean" for one within another: several for nested
    lists, and one, which is called as the key, for a scalar. What is null, or of _OPTIONAL and missing, gives as many
    missing values.
    """
    named = {key: {key.replace(".", "_"): c} if isinstance(c, Column) else c for key, c in fields.items()}
    keys = [(key.split("."), len(columns)) for key, columns in named.items()]

    def rows(document: Mapping) -> Rows:
        for item in (document,) if each is None else document[each]:
            yield [scalar for path, count in keys for scalar in _scalars(item, path, count)]

    return Table(name, {k: column for columns in named.values() for k, column in columns.items()}, rows)


def _scalars(value: Any, path: Sequence[str], count: int) -> list[Any]:
    for key in path:
        value = None if value is None else value.get(key) if key in _OPTIONAL else value[key]
    return [None] * count if value is None else _flat(value)


def _flat(value: Any) -> list[Any]:
    """The scalars of nested lists, in order."""
    return [scalar for part in value for scalar in _flat(part)] if isinstance(value, list) else [value]


# ------------------------------------------------------------------------------------------------ rows


def _float32(values: Any) -> list[float]:
    """As they are in single precision."""
    return np.array(values, "<f4").tolist()


def _detections(document: Mapping) -> Rows:
    return ((number, *position) for number, position in enumerate(document.get("detections", ())))


def _decision_cone(document: Mapping) -> Rows:
    return enumerate((document["cost"] or {}).get("cone", ()))


def _cone(cone: Any) -> Rows:
    for kind in ("samples", "desired"):
        for value in _float32(getattr(cone, kind)):
            yield cone.obstacle, cone.safe_share, kind, value


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


def _way(value: Any) -> Rows:
    for number, place in enumerate(value["line"]):
        yield value["number"], number, *place


def _way_drawn(value: Any) -> Rows:
    return ((value["number"], *disc) for disc in value["drawn"])


def _particles(cloud: Any) -> Rows:
    """The track's number is a whole one."""
    columns = decode_particles(cloud)
    numbers = [values.astype(int).tolist() if name == "track" else _float32(values) for name, values in columns.items()]
    return zip(*numbers, strict=True)


def _scan(scan: Any) -> Rows:
    step = (scan.end_angle - scan.start_angle) / max(1, len(scan.ranges) - 1)
    for beam, distance in enumerate(scan.ranges):
        yield beam, scan.start_angle + beam * step, distance


def _pose_figures(position: Any, turn: Any) -> list[float]:
    """x, y, z of a point and of a quaternion, and its w."""
    return [position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w]


def _placed(message: Any) -> Rows:
    yield message.frame_id, *_pose_figures(message.pose.position, message.pose.orientation)


def _transforms(message: Any) -> Rows:
    for transform in message.transforms:
        moved = _pose_figures(transform.translation, transform.rotation)
        yield transform.parent_frame_id, transform.child_frame_id, *moved


def _event(event: Any) -> Rows:
    yield Event.Level.Name(event.level), event.name, event.message


# -------------------------------------------------------------------------------------------- the tables

_PLACE, _VELOCITY, _TWIST = {"x": _M, "y": _M}, {"vx": _M_S, "vy": _M_S}, {"v": _M_S, "omega": _RAD_S}
_PLANAR, _STATE = {**_PLACE, "theta": _RAD}, {**_PLACE, **_VELOCITY}
_POSE = {**_PLACE, "z": _M, **dict.fromkeys(("qx", "qy", "qz", "qw"), _PURE)}
_AHEAD = {"ahead": _S, **_single(_PLACE)}
_CANDIDATE = {"candidate": _NUMBER, **_TWIST, **dict.fromkeys(("goal", "lane_left", "lane_right", "total"), _SINGLE)}
_ESTIMATE = {"estimate.mean": _prefixed("estimate", _PLANAR)}
_ESTIMATE |= {"estimate.covariance": _prefixed("estimate", _covariance(_PLANAR))}
_ESTIMATE |= {"estimate.ess": _PURE, "estimate.recovered": _FLAG}
_PERSON = {"name": _TEXT, "position": _PLACE, "velocity": _VELOCITY}
_TRACK = {**_PERSON, "covariance": _covariance(_STATE), "radius": _M, "ess": _PURE, "recovered": _FLAG}
_TRACK |= {"age": _S, "unseen": _S}
_DETECTION = {"time": {"measured": _S}, "position": _PLACE, "covariance": _covariance(_PLACE), "radius": _M}
_ODOMETRY = {"time": {"measured": _S}, "interval": _S, **_TWIST, "gyro": _RAD_S, "pose": _PLANAR}
_ODOMETRY |= {"odometry_pose": _prefixed("odometry", _PLANAR)}
_DECISION = {**_TWIST, "status": _TEXT, "advice": _TEXT, "nominal.v": _M_S, "nominal.omega": _RAD_S}
_DECISION |= {"cost.goal": _PURE, "cost.lane": {"cost_lane_left": _PURE, "cost_lane_right": _PURE}}
_DECISION |= {"cost.total": _PURE, "wish.v": _M_S, "wish.omega": _RAD_S}
_TIMING = {**{f"{phase}_ns": Column("int64", "ns") for phase in (*PHASES, "lateness")}, "deadline_missed": _FLAG}

_TABLES: tuple[tuple[str, Table], ...] = (
    ("/robot/state", _documents("robot_state", {"pose": _PLANAR, "twist": _TWIST, **_ESTIMATE})),
    ("/robot/truth", Table("robot_truth", {"frame": _TEXT, **_POSE}, _placed)),
    ("/robot/estimate", Table("robot_estimate", {"frame": _TEXT, **_POSE}, _placed)),
    ("/tf", Table("tf", {"parent": _TEXT, "child": _TEXT, **_POSE}, _transforms)),
    ("/people/truth", _documents("people_truth", {**_PERSON, "radius": _M}, each="people")),
    ("/people/estimate", _documents("people_estimate", _TRACK, each="people")),
    ("/people/estimate", Table("people_detections", {"detection": _NUMBER, **_PLACE}, _detections)),
    ("/detections", _documents("detections", {**_DETECTION, "beams": _NUMBER}, each="detections")),
    (
        "/contacts",
        _documents("contacts", {"kind": _TEXT, "name": _TEXT, "force": _N, "time": {"seen": _S}}, each="contacts"),
    ),
    ("/odometry", _documents("odometry", _ODOMETRY)),
    ("/scan", Table("scan", {"beam": _NUMBER, "angle": _RAD, "range": _M}, _scan)),
    ("/belief/robot", Table("belief_robot", _single({**_PLANAR, "weight": _PURE}), _particles)),
    (
        "/belief/obstacles",
        Table("belief_obstacles", {**_single({**_STATE, "weight": _PURE}), "track": _NUMBER}, _particles),
    ),
    ("/decision", _documents("decision", _DECISION)),
    ("/decision", Table("decision_cone", {"constraint": _NUMBER, "cost": _PURE}, _decision_cone)),
    ("/command", _documents("command", _TWIST)),
    ("/cone", Table("cone", {"obstacle": _TEXT, "safe_share": _PURE, "kind": _TEXT, "f": _SINGLE}, _cone)),
    ("/candidates", Table("candidates", {**_CANDIDATE, "role": _TEXT}, _candidates)),
    (
        "/candidates",
        Table("candidates_cone", {"candidate": _NUMBER, "constraint": _NUMBER, "cost": _SINGLE}, _candidates_cone),
    ),
    ("/plan", Table("plan", {**_AHEAD, "feasible": _FLAG}, _plan)),
    ("/plan", Table("plan_fan", {"rollout": _NUMBER, "cost": _SINGLE, **_AHEAD}, _plan_fan)),
    ("/plan", Table("plan_violation", {"sample": _NUMBER, "h": _SINGLE}, _plan_violation)),
    ("/way", Table("way", {"plan": _NUMBER, "point": _NUMBER, **_PLACE}, _way)),
    ("/way", Table("way_drawn", {"plan": _NUMBER, **_PLACE, "radius": _M}, _way_drawn)),
    ("/events", Table("events", dict.fromkeys(("level", "name", "text"), _TEXT), _event)),
    ("/tick", _documents("tick", _TIMING)),
)
# topic -> its tables
TABLES: Mapping[str, tuple[Table, ...]] = MappingProxyType(
    {topic: tuple(table for _, table in tables) for topic, tables in groupby(_TABLES, key=lambda entry: entry[0])}
)


def find_table(name: str) -> tuple[str, Table]:
    """The topic and the table of this name; of a topic's name its first table. Raises InvalidValue with the nearest."""
    found = {table.name: (topic, table) for topic, tables in TABLES.items() for table in tables}
    found |= {topic: (topic, tables[0]) for topic, tables in TABLES.items()}
    if name not in found:
        raise unknown_name("table", name, found)
    return found[name]


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

    @property
    def full(self) -> bool:
        return len(self._rows) >= BLOCK or self._characters > _LONG_TEXT

    def add(self, row: tuple) -> None:
        """Raises ValueError for a row that has not a value for each column."""
        if len(row) != len(self._table.columns):
            raise ValueError(f"{self._table.name}: {len(row)} values for {len(self._table.columns)} columns")
        self._rows.append(row)
        self._characters += sum(len(row[i]) for i in self._texts if isinstance(row[i], str))

    def block(self, budget: Budget, path: Path) -> Iterator[Block]:
        """All rows, which are gone afterwards; nothing where there are none."""
        if not self._rows:
            return
        columns = list(zip(*self._rows, strict=True))
        numbers = len(self._rows) * (len(columns) - len(self._texts))
        if not budget.allows_export(self._characters + _NUMBER_SIZE * numbers):
            what = f"{FREE_EXPORT} bytes and {EXPORT} for each of the log's"
            raise DamagedLogError(f"{path}: damaged: its tables would take more than {what}")
        self._rows, self._characters = [], 0
        yield Block(self._table, columns)


def blocks(path: Path, tables: Iterable[Table], messages: Iterable[LogMessage]) -> Iterator[Block]:
    """The rows that these messages of the log at `path` give in these tables, in their order.

    Raises DamagedLogError where they would take more room than a log of its size can fill, and what `not_ours` turns
    into a DamagedLogError where a message is not one of mjnav's.
    """
    budget = Budget(path.stat().st_size)
    waiting = {table.name: _Rows(table) for table in tables}
    chosen = {topic: [table for table in found if table.name in waiting] for topic, found in TABLES.items()}
    for message in messages:
        first = (message.sequence, message.time_ns / 1e9)
        for table in chosen[message.topic]:
            rows = waiting[table.name]
            for row in table.rows(message.value):
                rows.add((*first, *row))
                if rows.full:
                    yield from rows.block(budget, path)
    for rows in waiting.values():
        yield from rows.block(budget, path)


@contextmanager
def not_ours(path: Path) -> Iterator[None]:
    """Turns what a message that mjnav did not write raises into a DamagedLogError of one line."""
    try:
        yield
    except DamagedLogError:
        raise
    except (*NOT_OURS, struct.error) as error:
        raise DamagedLogError(f"{path}: holds a message that is not one of mjnav's ({error!r})") from error


# ------------------------------------------------------------------------------------- typed columns


def arrow_schema(table: Table) -> "pyarrow.Schema":
    """The types of a table's columns. Each field's metadata has its `unit`, and the schema's all `units` as JSON."""
    import pyarrow

    fields = [
        pyarrow.field(name, pyarrow.type_for_alias(column.type), metadata={"unit": column.unit})
        for name, column in table.columns.items()
    ]
    units = {name: column.unit for name, column in table.columns.items()}
    return pyarrow.schema(fields, metadata={"units": json.dumps(units)})


def arrow_batch(block: Block) -> "pyarrow.RecordBatch":
    """The rows of a block; null where a value is missing. Raises ValueError or TypeError for another type."""
    import pyarrow

    schema = arrow_schema(block.table)
    columns = [pyarrow.array(values, type=field.type) for values, field in zip(block.columns, schema, strict=True)]
    return pyarrow.record_batch(columns, schema=schema)


def check_pandas() -> None:
    """Raises InputError where pandas or pyarrow is not installed."""
    for package in ("pandas", "pyarrow"):
        with of_extra(package, "pandas"):
            __import__(package)


def data_frame(path: Path, table: Table, messages: Iterable[LogMessage]) -> "DataFrame":
    """The rows that these messages of the log at `path` give in the table; `attrs["units"]` has the units by column.

    Raises as `check_pandas`, and DamagedLogError where a message is not one of mjnav's.
    """
    check_pandas()
    import pandas
    import pyarrow

    with not_ours(path):
        batches = [arrow_batch(block) for block in blocks(path, [table], messages)]
    found = pyarrow.Table.from_batches(batches, schema=arrow_schema(table))
    nullable = {pyarrow.bool_(): pandas.BooleanDtype()}
    frame = found.to_pandas(types_mapper=nullable.get)
    frame.attrs["units"] = {name: column.unit for name, column in table.columns.items()}
    return frame
