"""Encodes the candidates of a decision: controls and costs, arcs as drawings, and the samples of one constraint.

/candidates holds what the controller compared, as arrays. v and omega are doubles, so that the chosen candidate is
found again by equality. The costs are float32: seven digits, half the bytes. /decision has the chosen candidate's cost
to the last bit.

/candidates/arcs holds the candidates as coloured lines, for viewers of a live run. No log has it.

/cone holds the constraint's samples for the closest obstacle at the chosen control.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from numpy.typing import ArrayLike

from mjnav.log.encode import protobuf
from mjnav.log.encode.geometry import WORLD_FRAME, pose, stamp
from mjnav.messages import Array, CandidateCosts, ConeDistribution, Decision
from mjnav.motion.unicycle import integrate

# ----------------------------------------------------------------------------------------- candidates


NONE_CHOSEN = -1

_COLUMN: protobuf.Fields = (("values", "float", True),)
_CANDIDATES: protobuf.Fields = (
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


def candidates_schema() -> protobuf.Schema:
    """mjnav.Candidates; the terms are unweighted, as in /decision."""
    return protobuf.protobuf_schema("mjnav.Candidates", {"mjnav.CostColumn": _COLUMN, "mjnav.Candidates": _CANDIDATES})


def chosen_candidate(decision: Decision) -> int | None:
    """The place of the cheapest candidate that is the controller's choice; None where no candidate is."""
    if (costs := decision.costs) is None:
        return None
    v, omega = decision.wish or (decision.v, decision.omega)
    best = int(np.argmin(costs.total))
    if costs.v[best] == v and costs.omega[best] == omega:
        return best
    same = np.flatnonzero((costs.v == v) & (costs.omega == omega))
    return int(same[np.argmin(costs.total[same])]) if same.size else None


def encode_candidates(pose: Array, decision: Decision, costs: CandidateCosts) -> bytes:
    """mjnav.Candidates of a decision taken at the believed pose (3,)."""
    chosen = chosen_candidate(decision)
    used = np.ones(len(costs.v)) @ (costs.cone != 0.0)  # how often, in a fifth of the time that `any` takes
    columns = [protobuf.encode_fields(_COLUMN, costs.cone[:, j]) if n else b"" for j, n in enumerate(used.tolist())]
    return protobuf.encode_fields(
        _CANDIDATES,
        pose,
        (decision.v, decision.omega),
        costs.v,
        costs.omega,
        costs.goal,
        columns,
        costs.lane[:, 0],
        costs.lane[:, 1],
        costs.total,
        costs.nominal,
        NONE_CHOSEN if chosen is None else chosen,
    )


# ---------------------------------------------------------------------------------------- drawn paths


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


_LEVELS = tuple(line_header(0.006, 0.02, _level_color(level)) for level in range(NUM_LEVELS))


def level_bounds(num_candidates: int) -> list[int]:
    """Where each of NUM_LEVELS levels begins among K candidates in the order of their cost, and where the last ends."""
    return [num_candidates * i // NUM_LEVELS for i in range(NUM_LEVELS + 1)]


def drawn_paths(paths: Array, header: bytes | None = None) -> bytes:
    """Fields `lines` of an entity: paths (n, points, 2) on the floor, coloured by their order, or all with `header`."""
    lines, where = _lines(*paths.shape[:2], header)
    lines = lines.copy()
    lines[where] = (np.rint(paths.reshape(-1, 2) / RESOLUTION) * RESOLUTION).view(np.uint8)
    return lines.tobytes()


@lru_cache(maxsize=32)  # a few numbers of paths and points
def _lines(n: int, size: int, header: bytes | None) -> tuple[np.ndarray, np.ndarray]:
    """What `drawn_paths` returns, with points at 0, as bytes; where in it x and y of each point are, (n size, 16).

    The indices of a line are the segments of its paths, one path after the other.
    """
    lines, points = b"", []
    levels = zip(_LEVELS, pairwise(level_bounds(n)), strict=True) if header is None else [(header, (0, n))]
    for line, (first, last) in levels:
        if first < last:
            corners = np.arange((last - first) * size, dtype="<u4").reshape(-1, size)
            segments = protobuf.delimited(8, np.stack([corners[:, :-1], corners[:, 1:]], axis=-1).tobytes())
            lines += protobuf.delimited(11, line + protobuf.encode_points(5, np.zeros((corners.size, 2))) + segments)
            points.append(len(lines) - len(segments) + protobuf.POINT_SIZE * (corners.ravel() - float(corners.size)))
    return np.frombuffer(lines, np.uint8), np.concatenate(points).astype(int)[:, np.newaxis] + protobuf.POINT_XY


# ----------------------------------------------------------------------------------------------- arcs


PREVIEW = 1.0  # [s] that an arc is drawn ahead
NUM_CORNERS = 2  # of an arc, beside its start
_DECIDED = line_header(0.05, 0.03, Color(r=0.1, g=0.25, b=1.0, a=1.0))


def encode_arcs(time: float, estimate: Array, control: ArrayLike, costs: CandidateCosts) -> bytes:
    """One foxglove.SceneUpdate: each candidate's arc coloured by its rank in total cost, the decided control's bold.

    The arcs start at the estimate (3,); control is (v, omega). Cost ranks, not costs: one infeasible candidate
    may cost a thousand times another, and a linear scale would paint all others alike.
    """
    order = np.argsort(costs.total, kind="stable")
    decided = np.asarray(control, float).reshape(1, 2)
    entity = SceneEntity(timestamp=stamp(time), frame_id=WORLD_FRAME, id="candidates").SerializeToString()
    candidates = drawn_paths(_arcs(estimate, costs.v[order], costs.omega[order]))
    chosen = drawn_paths(_arcs(estimate, *decided.T), _DECIDED)
    return protobuf.delimited(2, entity + candidates + chosen)


def _arcs(start: Array, v: Array, omega: Array) -> Array:
    """The arcs of n controls from the pose (3,): (n, 1 + NUM_CORNERS, 2)."""
    times = np.linspace(0.0, PREVIEW, NUM_CORNERS + 1)
    return np.stack([integrate(start, v, omega, time)[:, :2] for time in times], axis=1)


# ----------------------------------------------------------------------------------------------- cone


_CONE: protobuf.Fields = (
    ("obstacle", "string", False),
    ("samples", "float", True),  # F
    ("desired", "float", True),  # F^des
    ("safe_share", "double", False),
)


def cone_schema() -> protobuf.Schema:
    """mjnav.ConeDistribution: hundreds of samples a tick as JSON text take longer than the whole tick."""
    return protobuf.protobuf_schema("mjnav.ConeDistribution", {"mjnav.ConeDistribution": _CONE})


def encode_cone(cone: ConeDistribution) -> bytes:
    """mjnav.ConeDistribution."""
    return protobuf.encode_fields(_CONE, cone.obstacle, cone.samples, cone.desired, cone.safe_share)
