"""/candidates and /cone: what the controller weighed up."""

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet

from mjnav.messages import Array, CandidateCosts, ConeDistribution, Decision
from mjnav.motion.unicycle import integrate
from mjnav.recording import wire
from mjnav.recording.geometry import WORLD_FRAME, pose, time_ns

PREVIEW = 1.0  # [s] that an arc is drawn ahead
NUM_CORNERS = 2  # of an arc, beside its start
NUM_LEVELS = 8  # of colour
RESOLUTION = 2.0**-10  # [m]; drawn coordinates are whole multiples, whose doubles compress to a third

_LINE_LIST = 2
_SEGMENTS_SIZE = 8 * NUM_CORNERS  # [bytes]
_SHARES = np.arange(1, NUM_CORNERS + 1) / NUM_CORNERS


def _line_header(thickness: float, height: float) -> bytes:
    """foxglove.LinePrimitive, separate segments, but for points, colour and indices."""
    placed = pose(0.0, 0.0, height).SerializeToString()
    return wire.integer(1, _LINE_LIST) + wire.delimited(2, placed) + wire.double(3, thickness)


def _level_colors() -> tuple[bytes, ...]:
    """From green, the cheapest, over yellow to red."""
    share = np.linspace(0.0, 1.0, NUM_LEVELS)
    red, green = np.minimum(1.0, 2.0 * share), np.minimum(1.0, 2.0 - 2.0 * share)
    return tuple(
        wire.delimited(6, Color(r=0.85 * r, g=0.8 * g, b=0.15, a=0.5).SerializeToString())
        for r, g in zip(red.tolist(), green.tolist(), strict=True)
    )


_THIN, _BOLD = _line_header(0.006, 0.02), _line_header(0.05, 0.03)
_LEVEL_COLORS = _level_colors()
_ENTITY = wire.delimited(2, WORLD_FRAME.encode()) + wire.delimited(3, b"candidates")
_CHOSEN_COLOR = wire.delimited(6, Color(r=0.1, g=0.25, b=1.0, a=1.0).SerializeToString())


def _segments(num_arcs: int) -> bytes:
    """Indices of the segments of arcs that share point 0 and have NUM_CORNERS points of their own.

    _SEGMENTS_SIZE bytes an arc; those of fewer arcs are the beginning of those of more.
    """
    ends = np.empty((num_arcs, NUM_CORNERS, 2), "<u4")
    ends[..., 1] = 1 + np.arange(num_arcs * NUM_CORNERS).reshape(num_arcs, NUM_CORNERS)
    ends[:, 1:, 0] = ends[:, :-1, 1]
    ends[:, 0, 0] = 0
    return ends.tobytes()


def _corners(estimate: Array, v: Array, omega: Array) -> Array:
    """Points along each arc from the estimated pose, (K, NUM_CORNERS, 2)."""
    poses = integrate(estimate, v[:, None] * _SHARES, omega[:, None] * _SHARES, PREVIEW)
    return np.rint(poses[..., :2] / RESOLUTION) * RESOLUTION


def encode_candidates(time: float, estimate: Array, decision: Decision, costs: CandidateCosts) -> bytes:
    """One foxglove.SceneUpdate: each candidate's arc coloured by its rank in total cost, the chosen one bold.

    The arcs start at the estimated pose (3,). Cost ranks, not costs: one infeasible candidate may cost a thousand
    times another, and a linear scale would paint all others alike.
    """
    order = np.argsort(costs.total, kind="stable")
    v, omega = np.append(costs.v[order], decision.v), np.append(costs.omega[order], decision.omega)
    corners = _corners(estimate, v, omega)
    table = wire.points(5, corners[..., 0], corners[..., 1])
    start = wire.points(5, *np.rint(estimate[:2] / RESOLUTION) * RESOLUTION)
    arc_size = NUM_CORNERS * wire.POINT_SIZE
    indices = _segments(-(-order.size // NUM_LEVELS))
    lines = []
    for level, color in enumerate(_LEVEL_COLORS):
        first, last = (order.size * i // NUM_LEVELS for i in (level, level + 1))
        if first < last:
            arcs = table[first * arc_size : last * arc_size]
            segments = wire.delimited(8, indices[: (last - first) * _SEGMENTS_SIZE])
            lines.append(wire.delimited(11, b"".join((_THIN, start, arcs, color, segments))))
    bold = (_BOLD, start, table[-arc_size:], _CHOSEN_COLOR, wire.delimited(8, indices[:_SEGMENTS_SIZE]))
    lines.append(wire.delimited(11, b"".join(bold)))
    return wire.delimited(2, b"".join((wire.timestamp(1, time_ns(time)), _ENTITY, *lines)))


# ----------------------------------------------------------------------------------- cone distribution


def cone_schema() -> FileDescriptorSet:
    """mjnav.ConeDistribution as protobuf: hundreds of samples a tick as JSON text take longer than the whole tick."""
    kinds = FieldDescriptorProto
    file = FileDescriptorProto(name="mjnav/ConeDistribution.proto", package="mjnav", syntax="proto3")
    message = file.message_type.add(name="ConeDistribution")
    for number, (name, kind, label) in enumerate(
        (
            ("obstacle", kinds.TYPE_STRING, kinds.LABEL_OPTIONAL),
            ("samples", kinds.TYPE_FLOAT, kinds.LABEL_REPEATED),
            ("desired", kinds.TYPE_FLOAT, kinds.LABEL_REPEATED),
            ("safe_share", kinds.TYPE_DOUBLE, kinds.LABEL_OPTIONAL),
        ),
        start=1,
    ):
        message.field.add(name=name, number=number, type=kind, label=label)
    return FileDescriptorSet(file=[file])


def encode_cone(cone: ConeDistribution) -> bytes:
    """F and F^des as float32, the safe share exactly."""
    return b"".join(
        (
            wire.delimited(1, cone.obstacle.encode()),
            wire.packed_floats(2, cone.samples),
            wire.packed_floats(3, cone.desired),
            wire.double(4, cone.safe_share),
        )
    )
