"""Schemas that a log carries, so that other programs decode its messages, and protobuf's wire format.

mjnav's own protobuf messages are each a table of fields, which gives the schema and the bytes. Arrays are written
directly as bytes: a field is its tag (number << 3 | wire type) and its value, a submessage or packed array is a tag,
its length and its bytes, and joining the bytes of messages merges them. A message object for each point of a line takes
a hundred times as long. A message of which only numbers change is encoded by protobuf once (`numbered`).

Source: https://protobuf.dev/programming-guides/encoding/
"""

import re
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, wraps
from types import MappingProxyType
from typing import Any

import numpy as np
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.message import Message
from mcap_protobuf.schema import build_file_descriptor_set


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


def foxglove_schema(message: type[Message]) -> Schema:
    """A Foxglove message's description with all that it builds on."""
    return Schema(message.DESCRIPTOR.full_name, "protobuf", build_file_descriptor_set(message).SerializeToString())


# Of a protobuf message: name, type and whether it is repeated, numbered from 1.
Fields = Sequence[tuple[str, str, bool]]
_FORMATS = MappingProxyType({"double": "<f8", "float": "<f4"})
_VARINT, _FIXED64, _LENGTH_DELIMITED = 0, 1, 2


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


@np.errstate(over="ignore")  # a cost beyond float32 becomes infinite
def encode_fields(fields: Fields, *values: Any) -> bytes:
    """A message of these fields: numbers, texts, arrays, and lists of encoded messages, in the order of the fields."""
    parts = []
    for number, ((_, kind, repeated), value) in enumerate(zip(fields, values, strict=True), start=1):
        if repeated and kind in _FORMATS:
            parts.append(delimited(number, np.asarray(value, _FORMATS[kind]).tobytes()))
        elif repeated:
            parts += [delimited(number, message) for message in value]
        elif kind == "string":
            parts.append(delimited(number, value.encode()))
        elif kind == "double":
            parts.append(_varint(number << 3 | _FIXED64) + struct.pack("<d", value))
        else:
            parts.append(_varint(number << 3 | _VARINT) + _varint(value % 2**64))
    return b"".join(parts)


def delimited(number: int, data: bytes) -> bytes:
    """Field `number` with a string, bytes, a submessage or packed numbers."""
    return _head(number, len(data)) + data


@lru_cache(maxsize=1024)  # tags and lengths come again in every tick
def _head(number: int, length: int) -> bytes:
    return _varint(number << 3 | _LENGTH_DELIMITED) + _varint(length)


@lru_cache(maxsize=1024)
def _varint(value: int) -> bytes:
    """A non-negative integer, seven bits a byte."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def numbered(make: Callable[..., Message]) -> Callable[..., bytes]:
    """Encodes the message that `make(*fixed, numbers)` returns: by protobuf once, later with other numbers in it.

    `make` puts each of the doubles in as it is, once or more often.
    """

    @lru_cache(maxsize=1024)
    def laid_out(count: int, *fixed: Any) -> tuple[list[bytes | float], list[int], Callable[..., bytes]]:
        """What lies between the numbers, with room for them; which number goes where; the way to join them."""
        marks = struct.unpack(f"<{count}d", b"".join(_MARK % i.to_bytes(2) for i in range(count)))
        parts = _MARKED.split(make(*fixed, marks).SerializeToString())
        layout = "<" + "d".join(f"{len(part)}s" for part in parts[::2])
        return parts, [int.from_bytes(number) for number in parts[1::2]], struct.Struct(layout).pack

    @wraps(make)
    def encode(*arguments: Any) -> bytes:
        *fixed, numbers = arguments
        if not all(numbers):
            return make(*arguments).SerializeToString()  # without the fields that are 0
        parts, order, pack = laid_out(len(numbers), *fixed)
        parts = parts.copy()
        parts[1::2] = [numbers[i] for i in order]
        return pack(*parts)

    return encode


_MARK = b"mark%b\xf0\x7e"  # the bytes of a double that nothing else has: 1e303, and a number of two bytes
_MARKED = re.compile(_MARK.replace(b"%b", b"(..)"), re.DOTALL)


_POINT = np.dtype(
    [("tag", "u1"), ("length", "u1"), ("x_tag", "u1"), ("x", "<f8"), ("y_tag", "u1"), ("y", "<f8")]
)  # without padding: NumPy pads only on request
POINT_SIZE = _POINT.itemsize  # [bytes]
POINT_XY = np.array([*range(3, 11), *range(12, 20)])  # its bytes that are x and y


def encode_points(number: int, places: np.ndarray) -> bytes:
    """Repeated field `number` (< 16) of foxglove.Point3 at places (n, 2) on the floor; z = 0 is left out."""
    table = np.zeros(len(places), _POINT)
    table["tag"], table["length"] = number << 3 | _LENGTH_DELIMITED, POINT_SIZE - 2
    table["x_tag"], table["y_tag"] = 1 << 3 | _FIXED64, 2 << 3 | _FIXED64
    table["x"], table["y"] = places.T
    return table.tobytes()
