"""Encodes the candidates of a decision: controls and costs, arcs as drawings, and the samples of one constraint.

/candidates holds what the controller compared, as arrays. v and omega are doubles, so that the chosen candidate is
found again by equality. The costs are float32: seven digits, half the bytes. /decision has the chosen candidate's cost
to the last bit.

/candidates/arcs holds the candidates as coloured lines, for viewers that draw what a log holds. The live server sends
it, and a log has it where its run file says `[log] drawings = true`.

/cone holds the constraint's samples for the closest obstacle at the chosen control.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from numpy.typing import ArrayLike

from mjnav.log.encode import geometry as wire
from mjnav.log.encode.geometry import WORLD_FRAME, pose, time_ns
from mjnav.log.encode.schemas import Fields, Schema, protobuf_schema
from mjnav.messages import Array, CandidateCosts, ConeDistribution, Decision
from mjnav.motion.unicycle import integrate

# ----------------------------------------------------------------------------------------- candidates


NONE_CHOSEN = -1
MAX_COSTS = 10_000_000  # of all constraints in one message; a damaged one may name millions of empty columns

_COLUMN: Fields = (("values", "float", True),)
_CANDIDATES: Fields = (
    ("pose", "double", True),  # believed x, y [m], heading [rad], from which the candidates drive
    ("decision", "double", True),  # v [m/s], omega [rad/s]
    ("v", "double", True),  # [m/s]
    ("omega", "double", True),  # [rad/s]
    ("goal", "float", True),
    ("cone", "mjnav.CostColumn", True),  # one for each obstacle, then for each wall; without values it is 0 for all
    ("lane_left", "float", True),
    ("lane_right", "float", True),
    ("total", "float", True),
    ("nominal", "int32", False),  # its place in the arrays
    ("chosen", "int32", False),  # NONE_CHOSEN where the decision is no candidate
)


def candidates_schema() -> Schema:
    """mjnav.Candidates; the terms are unweighted, as in /decision."""
    return protobuf_schema("mjnav.Candidates", {"mjnav.CostColumn": _COLUMN, "mjnav.Candidates": _CANDIDATES})


def chosen_candidate(decision: Decision) -> int | None:
    """The place of the cheapest candidate that is the controller's choice; None where no candidate is."""
    if (costs := decision.costs) is None:
        return None
    v, omega = decision.wish or (decision.v, decision.omega)
    same = np.flatnonzero((costs.v == v) & (costs.omega == omega))
    return int(same[np.argmin(costs.total[same])]) if same.size else None


@np.errstate(over="ignore")  # a cost beyond float32 becomes infinite
def encode_candidates(pose: Array, decision: Decision, costs: CandidateCosts) -> bytes:
    """mjnav.Candidates of a decision taken at the believed pose (3,)."""
    chosen = chosen_candidate(decision)
    cone = np.ascontiguousarray(costs.cone.T, "<f4")
    used = np.logical_or.reduce(cone, axis=1).tolist()
    columns = [wire.packed_floats(1, cone[j]) if used[j] else b"" for j in range(len(used))]
    return b"".join(
        (
            wire.packed_doubles(1, pose),
            wire.packed_doubles(2, (decision.v, decision.omega)),
            wire.packed_doubles(3, costs.v),
            wire.packed_doubles(4, costs.omega),
            wire.packed_floats(5, costs.goal),
            *(wire.delimited(6, column) for column in columns),
            wire.packed_floats(7, costs.lane[:, 0]),
            wire.packed_floats(8, costs.lane[:, 1]),
            wire.packed_floats(9, costs.total),
            wire.integer(10, costs.nominal),
            wire.integer(11, NONE_CHOSEN if chosen is None else chosen),
        )
    )


@dataclass(frozen=True, slots=True)
class LoggedCandidates:
    """What one message of /candidates says."""

    pose: Array  # (3,) believed x, y [m], heading [rad]
    decision: Array  # (2,) v [m/s], omega [rad/s]
    costs: CandidateCosts
    chosen: int | None  # place in the arrays; None where the decision is no candidate


def decode_candidates(message: Any) -> LoggedCandidates:
    """The inverse of `encode_candidates`, from the decoded message. Raises ValueError where the sizes do not agree."""
    arrays = {name: np.array(getattr(message, name), float) for name in ("v", "omega", "goal", "total")}
    size = arrays["v"].size
    if size * len(message.cone) > MAX_COSTS:
        raise ValueError(f"{size} candidates with {len(message.cone)} constraints each")
    cone = np.zeros((size, len(message.cone)))
    for j, column in enumerate(message.cone):
        if len(column.values):
            cone[:, j] = column.values
    lane = np.stack([np.array(side, float) for side in (message.lane_left, message.lane_right)], axis=-1)
    if any(array.shape[0] != size for array in (*arrays.values(), lane)):
        raise ValueError("arrays of candidates that differ in length")
    costs = CandidateCosts(**arrays, cone=cone, lane=lane, nominal=message.nominal)
    chosen = None if message.chosen == NONE_CHOSEN else message.chosen
    pose, decision = (np.array(values, float) for values in (message.pose, message.decision))
    return LoggedCandidates(pose.reshape(3), decision.reshape(2), costs, chosen)


# ----------------------------------------------------------------------------------------------- arcs


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


# ----------------------------------------------------------------------------------------------- cone


def cone_schema() -> Schema:
    """mjnav.ConeDistribution: hundreds of samples a tick as JSON text take longer than the whole tick."""
    fields = (("obstacle", "string", False), ("samples", "float", True), ("desired", "float", True))
    return protobuf_schema(
        "mjnav.ConeDistribution", {"mjnav.ConeDistribution": (*fields, ("safe_share", "double", False))}
    )


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
