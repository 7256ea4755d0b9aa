"""/candidates/arcs: the candidates as coloured lines, for viewers that draw what a log holds.

The live server sends it, and a log has it where its run file says `[log] drawings = true`.
"""

from functools import lru_cache
from itertools import pairwise
from math import cos, sin

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from numpy.typing import ArrayLike

from mjnav.messages import Array, CandidateCosts
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


def _line(header: bytes, color: bytes, start: Array, x: Array, y: Array) -> bytes:
    """Field `lines` of the entity: arcs that share their start (2,); the corners x, y of n arcs, (n, NUM_CORNERS)."""
    table = wire.point_table(5, 1 + x.size)
    for axis, first, corners in zip("xy", start, (x, y), strict=True):
        table[axis][0], table[axis][1:] = first, corners.ravel()
        table[axis] = np.rint(table[axis] / RESOLUTION) * RESOLUTION
    return wire.delimited(11, header + table.tobytes() + color + wire.delimited(8, _segments(len(x))))


def encode_arcs(time: float, pose: Array, control: ArrayLike, costs: CandidateCosts) -> bytes:
    """One foxglove.SceneUpdate: each candidate's arc coloured by its rank in total cost, the decided control's bold.

    The arcs start at the estimated pose (3,); control is (v, omega). Cost ranks, not costs: one infeasible candidate
    may cost a thousand times another, and a linear scale would paint all others alike.
    """
    order = np.argsort(costs.total, kind="stable")
    x, y = _corners(pose, costs.v[order], costs.omega[order])
    lines = [
        _line(_THIN, color, pose[:2], x[first:last], y[first:last])
        for (first, last), color in zip(pairwise(level_bounds(order.size)), _LEVEL_COLORS, strict=True)
        if first < last
    ]
    decided = np.asarray(control, float)[:, None]
    lines.append(_line(_BOLD, _CHOSEN_COLOR, pose[:2], *_corners(pose, *decided)))
    return wire.delimited(2, wire.timestamp(1, time_ns(time)) + _ENTITY + b"".join(lines))
