"""mjnav's own small messages as JSON: a struct each, from which its text and its schema are made.

What metrics need is here to the last bit: JSON writes the shortest decimal that reads back as the same double. NaN and
infinities become null.
"""

import json
from collections.abc import Mapping, Sequence
from math import isfinite
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
from msgspec import UNSET, Meta, Struct, UnsetType

from mjnav import messages
from mjnav.log.encode.candidates import chosen_candidate
from mjnav.log.encode.protobuf import Schema
from mjnav.messages import Array

# --------------------------------------------------------------------------------------------- messages

Tick = Annotated[int, Meta(description="number of the tick")]
Seconds = Annotated[float, Meta(description="s")]
Speed = Annotated[float, Meta(description="m/s")]
TurnRate = Annotated[float, Meta(description="rad/s")]
Pose = Annotated[Array, Meta(description="x, y [m], heading [rad]")]
Ess = Annotated[float, Meta(description="effective sample size")]
Matrix = Annotated[Array, Meta(extra={"dimensions": 2})]  # a list of rows


class Twist(Struct):
    """A control or a motion."""

    v: Speed
    omega: TurnRate


class RobotEstimate(Struct):
    """The belief about the robot's pose."""

    mean: Pose
    covariance: Matrix  # (3, 3)
    ess: Ess
    recovered: bool


class RobotState(Struct):
    """/robot/state: the truth, and what is believed."""

    tick: Tick
    time: Seconds
    pose: Pose
    twist: Annotated[Array, Meta(description="v [m/s], omega [rad/s]")]
    estimate: RobotEstimate | None
    particles: Annotated[int, Meta(description="how many the belief has")] | UnsetType = UNSET


class Age(Struct):
    """How old a sensor's part of a reading is."""

    sensor: str
    age: Annotated[float, Meta(description="s")]


class Odometry(Struct):
    """/odometry: the sensors but for the lidar and the detector."""

    time: Seconds
    interval: Annotated[float, Meta(description="s since the reading before")]
    v: Speed
    omega: TurnRate
    gyro: TurnRate
    pose: Annotated[Array, Meta(description="by the pose sensor: x, y [m], heading [rad] in the map")]
    odometry_pose: Annotated[Array, Meta(description="where v and omega lead: x, y [m], heading [rad] in odom")]
    dropped: list[str] | UnsetType = UNSET  # sensors of which nothing arrived with this reading, if any
    ages: list[Age] | UnsetType = UNSET  # of what was measured before `time`


class Command(Struct):
    """/command: what is in force from now on."""

    tick: Tick
    v: Speed
    omega: TurnRate


class PlannedWay(Struct):
    """/way: the way that the robot has planned, and what it has drawn of the floor by then."""

    tick: Tick
    number: Annotated[int, Meta(description="of the plan")]
    line: Matrix  # (n, 2) [m] from where the robot was to the route's next point
    drawn: Matrix  # (k, 3) x, y, radius [m] of discs; empty of a robot that draws no map


class Cost(Struct):
    """What the chosen candidate cost; the terms are unweighted."""

    goal: float
    cone: Annotated[Array, Meta(description="of each obstacle, then of each wall")]
    lane: Annotated[Array, Meta(description="left and right")]
    total: float


class DecisionMessage(Struct):
    """/decision: `nominal` and `cost` are null for a method without candidates."""

    tick: Tick
    v: Speed
    omega: TurnRate
    status: str
    advice: str
    nominal: Twist | None
    cost: Cost | None
    wish: Twist | UnsetType = UNSET  # the control chosen, where the command is another one
    # Why the robot drives more slowly than chosen, or its recovery; else the wish was beyond its limits.
    caution: str | UnsetType = UNSET
    recovery: str | UnsetType = UNSET


class PersonState(Struct):
    """A true or a believed person; the truth has a name, a position, a velocity, and a radius where it changes."""

    name: str
    position: Annotated[Array, Meta(description="m")]
    velocity: Annotated[Array, Meta(description="m/s")]
    covariance: Matrix | UnsetType = UNSET  # (4, 4) of x, y, vx, vy
    radius: Annotated[float, Meta(description="m")] | UnsetType = UNSET
    ess: Ess | UnsetType = UNSET
    recovered: bool | UnsetType = UNSET
    age: Annotated[float, Meta(description="s since the track began")] | UnsetType = UNSET
    unseen: Annotated[float, Meta(description="s since its last detection")] | UnsetType = UNSET


class People(Struct):
    """/people/truth and /people/estimate; only the latter has detections, where there was a reading.

    These detections come with identity: the n-th is of person n. A track has `age` and `unseen` where it came about by
    scans.
    """

    tick: Tick
    people: list[PersonState]
    detections: Matrix | UnsetType = UNSET  # (n, 2) measured positions [m]


class LoggedDetection(Struct):
    """A body that the map does not explain, in one scan."""

    time: Annotated[float, Meta(description="s, mean of its beams")]
    position: Annotated[Array, Meta(description="m, of its centre in the map")]
    covariance: Matrix  # (2, 2) of the position
    radius: Annotated[float, Meta(description="m")]
    beams: Annotated[int, Meta(description="number of beams that met it")]


class Detections(Struct):
    """/detections: all of the latest scan, where people are tracked by scans."""

    tick: Tick
    detections: list[LoggedDetection]


class LoggedContact(Struct):
    """A contact of the robot."""

    kind: Annotated[str, Meta(description="person, table, wall or pillar")]
    name: str
    force: Annotated[float, Meta(description="N")]
    time: Annotated[float, Meta(description="s, when it was first seen")]


class Contacts(Struct):
    """/contacts: those seen since the message before."""

    tick: Tick
    contacts: list[LoggedContact]


Timing = msgspec.defstruct(
    "Timing",
    [
        ("tick", Tick),
        *((f"{phase}_ns", int) for phase in messages.PHASES),
        ("lateness_ns", Annotated[int, Meta(description="start behind its deadline")]),
        ("deadline_missed", bool),
    ],
)
MESSAGES: Mapping[str, type[Struct]] = MappingProxyType(
    {
        "mjnav.RobotState": RobotState,
        "mjnav.Odometry": Odometry,
        "mjnav.Command": Command,
        "mjnav.Way": PlannedWay,
        "mjnav.Decision": DecisionMessage,
        "mjnav.People": People,
        "mjnav.Detections": Detections,
        "mjnav.Contacts": Contacts,
        "mjnav.TickTiming": Timing,
    }
)

# --------------------------------------------------------------------------------------------- schemas

_TYPES = MappingProxyType({float: "number", int: "integer", bool: "boolean", str: "string"})


def document_schema(name: str) -> Schema:
    """The JSON Schema of one of MESSAGES, in the part of the language that viewers know.

    A Foxglove-like viewer drops a topic whose schema has two types for one value, references or lists of lists. So a
    number may be null, where it is not finite, and an object that is absent; and matrices, which messages have,
    are not in their schemas.
    """
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": name, **_object(MESSAGES[name])}
    return Schema(name, "jsonschema", json.dumps(schema).encode())


def _object(message: type[Struct]) -> dict[str, Any]:
    hints = get_type_hints(message, include_extras=True)
    properties = {key: schema for key, hint in hints.items() if (schema := _property(hint))}
    required = [field.name for field in msgspec.structs.fields(message) if field.required and field.name in properties]
    return {"type": "object", "properties": properties, "required": required}


def _property(hint: Any) -> dict[str, Any]:
    """The schema of a field by its type; empty for a matrix."""
    if get_origin(hint) in (Union, UnionType):
        return _property(next(option for option in get_args(hint) if option not in (NoneType, UnsetType)))
    if get_origin(hint) is Annotated:
        kind, meta = get_args(hint)
        description = {"description": meta.description} if meta.description else {}
        return {} if meta.extra else {**_property(kind), **description}
    if get_origin(hint) is list:
        return {"type": "array", "items": _property(get_args(hint)[0])}
    if get_origin(hint) is np.ndarray:
        return {"type": "array", "items": {"type": "number"}}
    return {"type": _TYPES[hint]} if hint in _TYPES else _object(hint)


# --------------------------------------------------------------------------------------------- encoders


def _builtin(value: Any) -> Any:
    """NumPy's arrays and numbers as Python's."""
    if isinstance(value, (np.ndarray, np.generic)):  # the union of both takes longer to test
        return value.tolist()
    raise NotImplementedError(f"a log's message holds a {type(value).__name__}")


_encode = msgspec.json.Encoder(enc_hook=_builtin).encode


def encode_robot(tick: int, truth: messages.WorldState, belief: messages.RobotBelief | None) -> bytes:
    """mjnav.RobotState."""
    estimate = belief and RobotEstimate(belief.mean, belief.covariance, belief.ess, belief.recovered)
    particles = UNSET if belief is None else len(belief.weights)
    return _encode(RobotState(tick, truth.time, truth.robot_pose, truth.robot_twist, estimate, particles))


def encode_odometry(reading: messages.Reading) -> bytes:
    """mjnav.Odometry."""
    v, omega = reading.odometry.tolist()
    known = (reading.time, reading.interval, v, omega, reading.gyro, reading.pose, reading.odometry_pose)
    return _encode(Odometry(*known, list(reading.dropped) or UNSET, [Age(*age) for age in reading.ages] or UNSET))


def encode_command(tick: int, command: Array) -> bytes:
    """mjnav.Command."""
    return _encode(Command(tick, *command.tolist()))


def encode_way(tick: int, way: messages.Way, drawn: Array) -> bytes:
    """mjnav.Way."""
    return _encode(PlannedWay(tick, way.number, way.line, drawn))


def encode_decision(tick: int, decision: messages.Decision) -> bytes:
    """mjnav.Decision."""
    nominal = cost = None
    if (costs := decision.costs) is not None:
        nominal = Twist(costs.v[costs.nominal], costs.omega[costs.nominal])
        if (i := chosen_candidate(decision)) is not None:
            cost = Cost(costs.goal[i], costs.cone[i], costs.lane[i], costs.total[i])
    wish = UNSET if decision.wish is None else Twist(*decision.wish)
    reasons = decision.caution or UNSET, decision.recovery or UNSET
    status = decision.status
    return _encode(
        DecisionMessage(tick, decision.v, decision.omega, str(status), status.advice, nominal, cost, wish, *reasons)
    )


def encode_people_truth(tick: int, truth: messages.WorldState) -> bytes:
    """mjnav.People: where they are."""
    radii = [UNSET] * len(truth.people_position) if truth.people_radius is None else truth.people_radius.tolist()
    states = zip(truth.people_position.tolist(), truth.people_velocity.tolist(), radii, strict=True)
    people = [PersonState(f"person{i}", p, v, radius=radius) for i, (p, v, radius) in enumerate(states)]
    return _encode(People(tick, people))


def _believed(track: messages.Track) -> PersonState:
    position, velocity = track.mean[:2], track.mean[2:]
    life = (track.age, track.unseen) if track.age or track.unseen else ()
    return PersonState(
        track.name, position, velocity, track.covariance, track.radius, track.ess, track.recovered, *life
    )


def encode_people_estimate(record: messages.TickRecord) -> bytes:
    """mjnav.People: where they are believed to be, and what the detector said."""
    detections = UNSET if record.reading is None else record.reading.detections
    return _encode(People(record.tick, [_believed(track) for track in record.tracks], detections))


def encode_detections(tick: int, found: Sequence[messages.Detection]) -> bytes:
    """mjnav.Detections."""
    parts = [LoggedDetection(one.time, one.position, one.covariance, one.radius, one.num_beams) for one in found]
    return _encode(Detections(tick, parts))


def encode_contacts(tick: int, truth: messages.WorldState) -> bytes:
    """mjnav.Contacts."""
    return _encode(Contacts(tick, [LoggedContact(c.kind, c.name, c.force, c.time) for c in truth.contacts]))


def encode_timing(timing: messages.TickTiming) -> bytes:
    """mjnav.TickTiming."""
    return _encode(Timing(timing.tick, *timing.phases, timing.lateness, timing.deadline_missed))


def dumps(document: Mapping) -> bytes:
    """Compact JSON of what a log may hold, which msgspec refuses in part: half of a surrogate pair in a text."""
    return json.dumps(_finite(document), separators=(",", ":"), allow_nan=False).encode()


def _finite(value: object) -> object:
    """The same document with null for what JSON has no number for."""
    if isinstance(value, float):
        return value if isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    return [_finite(part) for part in value] if isinstance(value, list | tuple) else value
