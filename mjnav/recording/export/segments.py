"""Foxglove's lines as the segments that they are drawn with."""

from itertools import pairwise
from typing import Any

from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive


def segments(line: Any) -> list[tuple[Any, Any]]:
    """The two ends of each segment of a foxglove.LinePrimitive, in its own pose."""
    corners = [line.points[i] for i in line.indices] if line.indices else list(line.points)
    if line.type == LinePrimitive.LINE_LIST:
        return list(zip(corners[0::2], corners[1::2], strict=True))
    if line.type == LinePrimitive.LINE_LOOP:
        corners += corners[:1]
    return list(pairwise(corners))
