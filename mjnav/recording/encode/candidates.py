"""/candidates and /cone: what the controller weighed up."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import cos, sin

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet

from mjnav.messages import Array, CandidateCosts, ConeDistribution, Decision
from mjnav.recording.encode import wire
from mjnav.recording.encode.geometry import WORLD_FRAME, pose, time_ns

PREVIEW = 1.0  # [s] that an arc is drawn ahead
NUM_CORNERS = 2  # of an arc, beside its start
NUM_LEVELS = 8  # of colour
RESOLUTION = 2.0**-10  # [m]; drawn coordinates are whole multiples, whose doubles compress to a third

_LINE_LIST = 2
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
    """Indices of the segments of arcs that share point 0 and have NUM_CORNERS points of their own."""
    ends = np.empty((num_arcs, NUM_CORNERS, 2), "<u4")
    ends[..., 1] = 1 + np.arange(num_arcs * NUM_CORNERS).reshape(num_arcs, NUM_CORNERS)
    ends[:, 1:, 0] = ends[:, :-1, 1]
    ends[:, 0, 0] = 0
    return ends.tobytes()


def _corners(estimate: Array, v: Array, omega: Array) -> tuple[Array, Array]:
    """x and y, (K, NUM_CORNERS) each, of points along each arc from the estimated pose; as `unicycle.integrate`."""
    x, y, heading = estimate.tolist()
    half = omega[:, None] * (0.5 * PREVIEW * _SHARES)
    sine, cosine = np.sin(half), np.cos(half)
    chord = np.divide(sine, half, out=np.ones_like(half), where=half != 0.0)
    chord *= v[:, None] * (PREVIEW * _SHARES)
    cosine *= chord
    sine *= chord
    ahead, left = cos(heading), sin(heading)
    return x + (ahead * cosine - left * sine), y + (left * cosine + ahead * sine)


@dataclass(frozen=True, slots=True)
class _Frame:
    """What is the same in every message about K candidates: a table of points, and the bytes between its stretches."""

    places: np.ndarray  # of each row's point among the start, the corners in order of cost and the chosen arc's
    table: bytes
    stretches: tuple[slice, ...]  # of the table: one a line, which begins with the start
    lines: tuple[tuple[bytes, bytes], ...]  # before and after each stretch


@lru_cache(maxsize=8)
def _frame(num_candidates: int) -> _Frame:
    bounds = [num_candidates * i // NUM_LEVELS for i in range(NUM_LEVELS + 1)]
    groups = [(*pair, _THIN, color) for pair, color in zip(pairwise(bounds), _LEVEL_COLORS, strict=True)]
    groups = [group for group in groups if group[0] < group[1]]
    groups.append((num_candidates, num_candidates + 1, _BOLD, _CHOSEN_COLOR))
    places, stretches, lines, size = [], [], [], 0
    for first, last, header, color in groups:
        points = [0, *range(1 + first * NUM_CORNERS, 1 + last * NUM_CORNERS)]
        places += points
        stretches.append(slice(size, size + len(points) * wire.POINT_SIZE))
        size = stretches[-1].stop
        after = color + wire.delimited(8, _segments(last - first))
        length = len(header) + len(points) * wire.POINT_SIZE + len(after)
        lines.append((wire.tag(11, wire.LENGTH_DELIMITED) + wire.varint(length) + header, after))
    table = wire.point_table(5, len(places)).tobytes()
    return _Frame(np.array(places), table, tuple(stretches), tuple(lines))


def encode_candidates(time: float, estimate: Array, decision: Decision, costs: CandidateCosts) -> bytes:
    """One foxglove.SceneUpdate: each candidate's arc coloured by its rank in total cost, the chosen one bold.

    The arcs start at the estimated pose (3,). Cost ranks, not costs: one infeasible candidate may cost a thousand
    times another, and a linear scale would paint all others alike.
    """
    order = np.argsort(costs.total, kind="stable")
    frame = _frame(order.size)
    v, omega = np.empty((2, order.size + 1))
    v[:-1], v[-1] = costs.v[order], decision.v
    omega[:-1], omega[-1] = costs.omega[order], decision.omega
    data = bytearray(frame.table)
    rows = np.frombuffer(data, wire.POINT)
    for axis, start, corners in zip("xy", estimate.tolist(), _corners(estimate, v, omega), strict=False):
        points = np.empty(1 + corners.size)
        points[0], points[1:] = start, corners.ravel()
        rows[axis] = (np.rint(points / RESOLUTION) * RESOLUTION)[frame.places]
    table = memoryview(data)
    pieces: list[bytes | memoryview] = [wire.timestamp(1, time_ns(time)), _ENTITY]
    for stretch, (before, after) in zip(frame.stretches, frame.lines, strict=True):
        pieces.extend((before, table[stretch], after))
    return wire.delimited(2, b"".join(pieces))


@dataclass(frozen=True, slots=True)
class CandidateArcs:
    """The arcs of one message, the cheapest first."""

    start: Array  # (2,) [m]
    ends: Array  # (K, 2) [m], after PREVIEW seconds
    level: np.ndarray  # (K,) bytes, of colour


def decode_candidates(message: SceneUpdate) -> CandidateArcs:
    """What a message of /candidates draws, but for the chosen arc."""
    *lines, _ = message.entities[0].lines
    start = lines[0].points[0]
    ends = [[(point.x, point.y) for point in line.points[NUM_CORNERS::NUM_CORNERS]] for line in lines]
    level = np.repeat(np.arange(len(lines), dtype=np.uint8), [len(part) for part in ends])
    return CandidateArcs(np.array([start.x, start.y]), np.array([end for part in ends for end in part]), level)


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
