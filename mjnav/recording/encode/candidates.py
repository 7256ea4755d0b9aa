"""/candidates: what the controller weighed up, as arrays.

v and omega are doubles, so that the chosen one is found again by equality. The costs are float32: seven digits, half
the bytes. What the chosen candidate cost stands in /decision to the last bit.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mjnav.messages import Array, CandidateCosts, Decision
from mjnav.recording.encode import wire
from mjnav.recording.encode.schemas import Fields, Schema, protobuf_schema

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
