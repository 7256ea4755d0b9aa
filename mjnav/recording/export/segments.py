"""Foxglove's lines as the segments that they are drawn with."""

from collections.abc import Iterator
from itertools import chain, pairwise
from typing import Any

from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive


def segments(line: Any) -> Iterator[tuple[Any, Any]]:
    """The two ends of each segment of a foxglove.LinePrimitive, in its own pose, one by one: few bytes may be many."""
    corners = (line.points[i] for i in line.indices) if line.indices else iter(line.points)
    if line.type == LinePrimitive.LINE_LIST:
        return zip(corners, corners, strict=True)
    if line.type == LinePrimitive.LINE_LOOP and (first := next(corners, None)) is not None:
        corners = chain((first,), corners, (first,))
    return pairwise(corners)
