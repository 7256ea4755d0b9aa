"""The JSON Schemas of mjnav's own messages, and the description that Foxglove's carry with them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import Message
from mcap_protobuf.schema import build_file_descriptor_set

from mjnav.messages import PHASES


@dataclass(frozen=True, slots=True)
class Schema:
    """A schema as the log carries it."""

    name: str
    encoding: str  # "protobuf" or "jsonschema"
    data: bytes

    @property
    def message_encoding(self) -> str:
        """How messages of this schema are encoded."""
        return "protobuf" if self.encoding == "protobuf" else "json"


def _number(description: str) -> dict:
    return {"type": ["number", "null"], "description": description}


def _numbers(description: str, *shape: int) -> dict:
    schema: dict = {"type": ["number", "null"]}
    for size in reversed(shape):
        schema = {"type": "array", "items": schema, "minItems": size, "maxItems": size}
    return {**schema, "description": description}


def _list(items: dict, description: str = "") -> dict:
    return {"type": "array", "items": items, **({"description": description} if description else {})}


def _object(properties: dict, *, optional: tuple[str, ...] = (), nullable: bool = False) -> dict:
    required = [name for name in properties if name not in optional]
    return {"type": ["object", "null"] if nullable else "object", "properties": properties, "required": required}


_STRING, _BOOLEAN, _INTEGER = {"type": "string"}, {"type": "boolean"}, {"type": "integer"}
_TICK = {"tick": {**_INTEGER, "description": "number of the tick"}}
_TWIST = {"v": _number("m/s"), "omega": _number("rad/s")}
_BELIEF = {"ess": _number("effective sample size"), "recovered": _BOOLEAN}

_DOCUMENTS: Mapping[str, dict] = MappingProxyType(
    {
        "mjnav.RobotState": _object(
            {
                **_TICK,
                "time": _number("s"),
                "pose": _numbers("true x, y [m], heading [rad]", 3),
                "twist": _numbers("true v [m/s], omega [rad/s]", 2),
                "estimate": _object(
                    {"mean": _numbers("x, y [m], heading [rad]", 3), "covariance": _numbers("", 3, 3), **_BELIEF},
                    nullable=True,
                ),
            }
        ),
        "mjnav.Odometry": _object(
            {
                "time": _number("s"),
                "interval": _number("s since the reading before"),
                **_TWIST,
                "gyro": _number("rad/s"),
                "pose": _numbers("of the pose sensor: x, y [m], heading [rad]", 3),
            }
        ),
        "mjnav.Command": _object({**_TICK, **_TWIST}),
        "mjnav.Decision": _object(
            {
                **_TICK,
                **_TWIST,
                "status": _STRING,
                "advice": _STRING,
                "nominal": _object(_TWIST, nullable=True),
                "cost": _object(
                    {
                        "goal": _number("of the chosen control"),
                        "cone": _list(_number(""), "unweighted, of each obstacle, then of each wall"),
                        "lane": _numbers("unweighted, left and right", 2),
                        "total": _number("of the chosen control"),
                    },
                    nullable=True,
                ),
                "wish": _object(_TWIST, nullable=True),  # the control chosen, where it was beyond the robot's limits
            },
            optional=("wish",),
        ),
        "mjnav.People": _object(
            {
                **_TICK,
                "people": _list(
                    _object(
                        {
                            "name": _STRING,
                            "position": _numbers("m", 2),
                            "velocity": _numbers("m/s", 2),
                            "covariance": _numbers("of x, y, vx, vy", 4, 4),
                            "radius": _number("m"),
                            **_BELIEF,
                        },
                        optional=("covariance", "radius", "ess", "recovered"),
                    )
                ),
                "detections": _list(_numbers("m", 2), "measured positions"),
            },
            optional=("detections",),
        ),
        "mjnav.Contacts": _object(
            {
                **_TICK,
                "contacts": _list(
                    _object(
                        {
                            "kind": {"enum": ["person", "table", "wall", "pillar"]},
                            "name": _STRING,
                            "force": _number("N"),
                            "time": _number("s, when it was first seen"),
                        }
                    )
                ),
            }
        ),
        "mjnav.TickTiming": _object(
            {
                **_TICK,
                **{f"{phase}_ns": _INTEGER for phase in PHASES},
                "lateness_ns": {**_INTEGER, "description": "start behind its deadline"},
                "deadline_missed": _BOOLEAN,
            }
        ),
    }
)


def document_schema(name: str) -> Schema:
    """The JSON Schema of one of mjnav's messages."""
    schema = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": name, **_DOCUMENTS[name]}
    return Schema(name, "jsonschema", json.dumps(schema).encode())


def foxglove_schema(message: type[Message]) -> Schema:
    """A Foxglove message's description with all that it builds on."""
    return Schema(message.DESCRIPTOR.full_name, "protobuf", build_file_descriptor_set(message).SerializeToString())


Fields = Sequence[
    tuple[str, str, bool]
]  # of a protobuf message: name, type and whether it is repeated, numbered from 1


def protobuf_schema(name: str, messages: Mapping[str, Fields]) -> Schema:
    """A protobuf message of mjnav's own with the messages that it is made of, by their full names."""
    file = FileDescriptorProto(name=f"{name.replace('.', '/')}.proto", package="mjnav", syntax="proto3")
    for full_name, fields in messages.items():
        message = file.message_type.add(name=full_name.removeprefix("mjnav."))
        for number, (field, kind, repeated) in enumerate(fields, start=1):
            label = FieldDescriptorProto.LABEL_REPEATED if repeated else FieldDescriptorProto.LABEL_OPTIONAL
            described = message.field.add(name=field, number=number, label=label)
            if kind in messages:
                described.type, described.type_name = FieldDescriptorProto.TYPE_MESSAGE, f".{kind}"
            else:
                described.type = FieldDescriptorProto.Type.Value(f"TYPE_{kind.upper()}")
    return Schema(name, "protobuf", FileDescriptorSet(file=[file]).SerializeToString())
