"""The scene and the candidates as RViz draws them."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from rosbags.typesys.stores import ros2_humble as ros

from mjnav.recording.encode.candidates import decode_candidates, encode_arcs
from mjnav.recording.export.ros_messages import header, same_point, same_turn, same_vector, vector
from mjnav.recording.read.tables import segments


def markers(update: Any, now: int) -> ros.visualization_msgs__msg__MarkerArray:
    """foxglove.SceneUpdate: the entity's name is the namespace, in which each message replaces the one before."""
    drawn: list[Any] = [
        _marker(entity, number, shape, now)
        for entity in update.entities
        for number, shape in enumerate(_shapes(entity))
    ]
    return ros.visualization_msgs__msg__MarkerArray(drawn)


def candidate_markers(message: Any, now: int) -> ros.visualization_msgs__msg__MarkerArray:
    """mjnav.Candidates as coloured arcs, the same as those of /candidates/arcs."""
    found = decode_candidates(message)
    return markers(SceneUpdate.FromString(encode_arcs(1e-9 * now, found.pose, found.decision, found.costs)), now)


def _shapes(entity: Any) -> Iterator[tuple[int, Any, ros.geometry_msgs__msg__Vector3, list]]:
    """The marker's type, the Foxglove primitive, its scale and its points."""
    kind = ros.visualization_msgs__msg__Marker
    for cube in entity.cubes:
        yield kind.CUBE, cube, same_vector(cube.size), []
    for cylinder in entity.cylinders:
        yield kind.CYLINDER, cylinder, same_vector(cylinder.size), []
    for arrow in entity.arrows:
        size = vector(arrow.shaft_length + arrow.head_length, arrow.head_diameter, arrow.head_diameter)
        yield kind.ARROW, arrow, size, []
    for text in entity.texts:
        yield kind.TEXT_VIEW_FACING, text, vector(z=text.font_size), []
    for line in entity.lines:
        corners = [same_point(end) for ends in segments(line) for end in ends]
        yield kind.LINE_LIST, line, vector(x=line.thickness), corners


def _marker(entity: Any, number: int, shape: tuple, now: int) -> ros.visualization_msgs__msg__Marker:
    kind, primitive, scale, points = shape
    place, color = primitive.pose, primitive.color
    return ros.visualization_msgs__msg__Marker(
        header=header(now, entity.frame_id),
        ns=entity.id,
        id=number,
        type=kind,
        action=ros.visualization_msgs__msg__Marker.ADD,
        pose=ros.geometry_msgs__msg__Pose(same_point(place.position), same_turn(place.orientation)),
        scale=scale,
        color=ros.std_msgs__msg__ColorRGBA(color.r, color.g, color.b, color.a),
        lifetime=ros.builtin_interfaces__msg__Duration(*divmod(entity.lifetime.ToNanoseconds(), 10**9)),
        frame_locked=entity.frame_locked,
        points=points,
        colors=[],
        texture_resource="",
        texture=ros.sensor_msgs__msg__CompressedImage(header(0, ""), "", np.zeros(0, np.uint8)),
        uv_coordinates=[],
        text=getattr(primitive, "text", ""),
        mesh_resource="",
        mesh_file=ros.visualization_msgs__msg__MeshFile("", np.zeros(0, np.uint8)),
        mesh_use_embedded_materials=False,
    )
