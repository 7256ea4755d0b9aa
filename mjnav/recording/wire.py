"""Protobuf's wire format for what a tick repeats hundreds of times.

A field is its tag (number << 3 | wire type) and its value; a submessage is a tag, its length and its bytes; joining the
bytes of messages merges them. A point of three doubles has always the same length, so a table of points is one
structured array. Building a message object for each point takes a hundred times as long.

Source: https://protobuf.dev/programming-guides/encoding/
"""

import struct

import numpy as np
from numpy.typing import ArrayLike

VARINT, FIXED64, LENGTH_DELIMITED = 0, 1, 2
_DOUBLES_SIZE = 27  # [bytes] three doubles, each behind a tag of one byte


def varint(value: int) -> bytes:
    """A non-negative integer, seven bits a byte."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def tag(number: int, wire_type: int) -> bytes:
    """The tag of field `number`."""
    return varint(number << 3 | wire_type)


def delimited(number: int, data: bytes) -> bytes:
    """Field `number` with a string, bytes, a submessage or packed numbers."""
    return tag(number, LENGTH_DELIMITED) + varint(len(data)) + data


def integer(number: int, value: int) -> bytes:
    """Field `number` with a non-negative integer, a bool or an enumeration's value."""
    return tag(number, VARINT) + varint(value)


def double(number: int, value: float) -> bytes:
    """Field `number` with a double."""
    return tag(number, FIXED64) + struct.pack("<d", value)


def timestamp(number: int, time_ns: int) -> bytes:
    """Field `number` with a google.protobuf.Timestamp."""
    seconds, nanos = divmod(time_ns, 1_000_000_000)
    return delimited(number, integer(1, seconds) + integer(2, nanos))


_COORDINATES = tuple(column for axis in "xyz" for column in ((f"{axis}_tag", "u1"), (axis, "<f8")))
_POINT = np.dtype([("tag", "u1"), ("length", "u1"), *_COORDINATES])  # without padding: NumPy pads only on request
POINT_SIZE = _POINT.itemsize  # [bytes]


def points(number: int, x: ArrayLike, y: ArrayLike, z: ArrayLike = 0.0) -> bytes:
    """Repeated field `number` (< 16) of foxglove.Point3, one for each element of x, y, z; POINT_SIZE bytes each."""
    x, y, z = np.broadcast_arrays(x, y, z)
    table = np.empty(x.size, _POINT)
    table["tag"] = number << 3 | LENGTH_DELIMITED
    table["length"] = _DOUBLES_SIZE
    for field_number, (name, values) in enumerate((("x", x), ("y", y), ("z", z)), start=1):
        table[f"{name}_tag"] = field_number << 3 | FIXED64
        table[name] = values.ravel()
    return table.tobytes()


def packed_doubles(number: int, values: ArrayLike) -> bytes:
    """Packed repeated field `number` of doubles."""
    return delimited(number, np.asarray(values, "<f8").tobytes())


def packed_floats(number: int, values: ArrayLike) -> bytes:
    """Packed repeated field `number` of floats."""
    return delimited(number, np.asarray(values, "<f4").tobytes())
