"""The shapes of a foxglove.SceneUpdate as rows of numbers."""

from collections.abc import Iterator
from itertools import chain, pairwise
from typing import Any

from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive


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
