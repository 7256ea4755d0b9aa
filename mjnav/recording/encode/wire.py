"""Protobuf's wire format for what a tick repeats hundreds of times.

A field is its tag (number << 3 | wire type) and its value; a submessage is a tag, its length and its bytes; joining the
bytes of messages merges them. A point of two doubles has always the same length, so a table of points is one
structured array, and a message of which only some doubles change is bytes with holes. Building a message object for
each point takes a hundred times as long.

Source: https://protobuf.dev/programming-guides/encoding/
"""

import struct
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

VARINT, FIXED64, LENGTH_DELIMITED = 0, 1, 2


def varint(value: int) -> bytes:
    """A non-negative integer, seven bits a byte."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


@lru_cache(maxsize=128)  # of a few dozen
def tag(number: int, wire_type: int) -> bytes:
    """The tag of field `number`."""
    return varint(number << 3 | wire_type)


def delimited(number: int, data: bytes) -> bytes:
    """Field `number` with a string, bytes, a submessage or packed numbers."""
    return tag(number, LENGTH_DELIMITED) + varint(len(data)) + data


def integer(number: int, value: int) -> bytes:
    """Field `number` with an integer of at most 64 bits, a bool or an enumeration's value."""
    return tag(number, VARINT) + varint(value % 2**64)


def double(number: int, value: float) -> bytes:
    """Field `number` with a double."""
    return tag(number, FIXED64) + struct.pack("<d", value)


@lru_cache(maxsize=8)  # the messages of a tick share a few
def timestamp(number: int, time_ns: int) -> bytes:
    """Field `number` with a google.protobuf.Timestamp."""
    seconds, nanos = divmod(time_ns, 1_000_000_000)
    return delimited(number, integer(1, seconds) + integer(2, nanos))


POINT = np.dtype(
    [("tag", "u1"), ("length", "u1"), ("x_tag", "u1"), ("x", "<f8"), ("y_tag", "u1"), ("y", "<f8")]
)  # without padding: NumPy pads only on request
POINT_SIZE = POINT.itemsize  # [bytes]


def point_table(number: int, num_points: int) -> np.ndarray:
    """Repeated field `number` (< 16) of foxglove.Point3, of dtype POINT; "x" and "y" are to be filled in.

    z = 0 is left out.
    """
    table = np.zeros(num_points, POINT)
    table["tag"] = number << 3 | LENGTH_DELIMITED
    table["length"] = POINT_SIZE - 2
    table["x_tag"] = 1 << 3 | FIXED64
    table["y_tag"] = 2 << 3 | FIXED64
    return table


class Template:
    """The bytes of a message of which only some doubles change.

    `encode` maps `num_holes` non-zero doubles to the message's bytes, in which each stands once and in their order.
    """

    def __init__(self, encode: Callable[[Sequence[float]], bytes], num_holes: int):
        marks = [1.0 + (i + 1) / 1024.0 for i in range(num_holes)]
        rest, layout = encode(marks), "<"
        self._pieces: list[bytes | float] = []
        for i, mark in enumerate(marks):
            before, found, rest = rest.partition(struct.pack("<d", mark))
            if not found:
                raise ValueError(f"hole {i} of {num_holes} is not in the message")
            self._pieces += [before, mark]
            layout += f"{len(before)}sd"
        self._pieces.append(rest)
        self._pack = struct.Struct(f"{layout}{len(rest)}s").pack

    def fill(self, values: Sequence[float]) -> bytes:
        """The message with these doubles, as many as there are holes; one that is 0 is written too."""
        pieces = self._pieces.copy()
        pieces[1::2] = values
        return self._pack(*pieces)


def packed_doubles(number: int, values: ArrayLike) -> bytes:
    """Packed repeated field `number` of doubles."""
    return delimited(number, np.asarray(values, "<f8").tobytes())


def packed_floats(number: int, values: ArrayLike) -> bytes:
    """Packed repeated field `number` of floats."""
    return delimited(number, np.asarray(values, "<f4").tobytes())
