"""/candidates/arcs: the candidates as coloured lines, for viewers that draw what a log holds.

The live server sends it, and a log has it where its run file says `[log] drawings = true`.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from numpy.typing import ArrayLike

from mjnav.messages import Array, CandidateCosts
from mjnav.motion.unicycle import integrate
from mjnav.recording.encode import wire
from mjnav.recording.encode.geometry import WORLD_FRAME, pose, time_ns

PREVIEW = 1.0  # [s] that an arc is drawn ahead
NUM_CORNERS = 2  # of an arc, beside its start
NUM_LEVELS = 8  # of colour
RESOLUTION = 2.0**-10  # [m]; drawn coordinates are whole multiples, whose doubles compress to a third


def line_header(thickness: float, height: float, color: Color) -> bytes:
    """foxglove.LinePrimitive, separate segments, but for points and indices."""
    kind = LinePrimitive.LINE_LIST
    return LinePrimitive(type=kind, pose=pose(0.0, 0.0, height), thickness=thickness, color=color).SerializeToString()


def _level_color(level: int) -> Color:
    """From green, the cheapest, over yellow to red."""
    share = level / (NUM_LEVELS - 1)
    return Color(r=0.85 * min(1.0, 2.0 * share), g=0.8 * min(1.0, 2.0 - 2.0 * share), b=0.15, a=0.5)


LEVEL_HEADERS = tuple(line_header(0.006, 0.02, _level_color(level)) for level in range(NUM_LEVELS))
_DECIDED = line_header(0.05, 0.03, Color(r=0.1, g=0.25, b=1.0, a=1.0))
_ENTITY = wire.delimited(2, WORLD_FRAME.encode()) + wire.delimited(3, b"candidates")


def level_bounds(num_candidates: int) -> list[int]:
    """Where each of NUM_LEVELS levels begins among K candidates in the order of their cost, and where the last ends."""
    return [num_candidates * i // NUM_LEVELS for i in range(NUM_LEVELS + 1)]


@lru_cache(maxsize=32)  # two for each number of candidates, and one
def _segments(num_arcs: int) -> bytes:
    """Indices of the segments of arcs that share point 0 and have NUM_CORNERS points of their own."""
    ends = np.empty((num_arcs, NUM_CORNERS, 2), "<u4")
    ends[..., 1] = 1 + np.arange(num_arcs * NUM_CORNERS).reshape(num_arcs, NUM_CORNERS)
    ends[:, 1:, 0] = ends[:, :-1, 1]
    ends[:, 0, 0] = 0
    return ends.tobytes()


def _line(header: bytes, start: Array, v: Array, omega: Array) -> bytes:
    """Field `lines` of the entity: the arcs of n controls from the pose `start` (3,)."""
    shares = np.arange(1, NUM_CORNERS + 1) / NUM_CORNERS
    corners = np.stack([integrate(start, v, omega, PREVIEW * share)[:, :2] for share in shares], axis=1)
    points = np.rint(np.vstack([start[:2], corners.reshape(-1, 2)]) / RESOLUTION) * RESOLUTION
    table = wire.point_table(5, len(points))
    table["x"], table["y"] = points.T
    return wire.delimited(11, header + table.tobytes() + wire.delimited(8, _segments(len(v))))


def encode_arcs(time: float, estimate: Array, control: ArrayLike, costs: CandidateCosts, epoch: int = 0) -> bytes:
    """One foxglove.SceneUpdate: each candidate's arc coloured by its rank in total cost, the decided control's bold.

    The arcs start at the estimate (3,); control is (v, omega). Cost ranks, not costs: one infeasible candidate
    may cost a thousand times another, and a linear scale would paint all others alike.
    """
    order = np.argsort(costs.total, kind="stable")
    bounds = pairwise(level_bounds(order.size))
    groups = [
        (header, order[first:last]) for header, (first, last) in zip(LEVEL_HEADERS, bounds, strict=True) if first < last
    ]
    lines = [_line(header, estimate, costs.v[group], costs.omega[group]) for header, group in groups]
    v, omega = np.asarray(control, float)
    lines.append(_line(_DECIDED, estimate, np.array([v]), np.array([omega])))
    return wire.delimited(2, wire.timestamp(1, time_ns(time, epoch)) + _ENTITY + b"".join(lines))
