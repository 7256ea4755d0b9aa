"""The schemas that a log carries, so that other programs decode its messages."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType, NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import msgspec
import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import Message
from mcap_protobuf.schema import build_file_descriptor_set
from msgspec import Struct, UnsetType


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


_JSON_TYPES = MappingProxyType({float: "number", int: "integer", bool: "boolean", str: "string"})


def json_schema(name: str, message: type[Struct]) -> Schema:
    """The JSON Schema of a message, in the part of the language that viewers know.

    A Foxglove-like viewer drops a topic whose schema has two types for one value, references or lists of lists. So a
    number may be null, where it is not finite, and an object that is absent; and matrices, which messages have,
    are not in their schemas.
    """
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return Schema(name, "jsonschema", json.dumps({"$schema": dialect, "title": name, **_object(message)}).encode())


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
    return {"type": _JSON_TYPES[hint]} if hint in _JSON_TYPES else _object(hint)


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
