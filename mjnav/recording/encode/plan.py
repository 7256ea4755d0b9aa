"""/plan: what a method that plans ahead weighed, as arrays of float32: a metre to the micrometre, half the bytes."""

from typing import Any

import numpy as np

from mjnav.messages import PlanShown
from mjnav.recording.encode import wire
from mjnav.recording.encode.schemas import Fields, Schema, protobuf_schema

_PLAN: Fields = (
    ("step", "double", False),  # [s] between the positions of a path
    ("path", "float", True),  # x, y [m] in the map after each step, of the plan that is followed
    ("fan", "float", True),  # the same of each rollout shown, one after the other, cheapest first
    ("fan_cost", "float", True),  # of each
    ("violation", "float", True),  # of each joint sample under the plan; empty of a method without
    ("feasible", "bool", False),
)


def plan_schema() -> Schema:
    """mjnav.Plan; all paths have as many positions as the plan's."""
    return protobuf_schema("mjnav.Plan", {"mjnav.Plan": _PLAN})


@np.errstate(over="ignore")  # a cost beyond float32 becomes infinite
def encode_plan(plan: PlanShown) -> bytes:
    """mjnav.Plan."""
    return b"".join(
        (
            wire.double(1, plan.step),
            wire.packed_floats(2, plan.path),
            wire.packed_floats(3, plan.fan),
            wire.packed_floats(4, plan.fan_cost),
            wire.packed_floats(5, plan.violation),
            wire.integer(6, plan.feasible),
        )
    )


def decode_plan(message: Any) -> PlanShown:
    """The inverse of `encode_plan`, from the decoded message. Raises ValueError where the sizes do not agree."""
    path, fan, cost, violation = (
        np.array(getattr(message, name), float) for name in ("path", "fan", "fan_cost", "violation")
    )
    if path.size % 2 or fan.size != cost.size * path.size:
        raise ValueError(f"a path of {path.size} numbers, {cost.size} rollouts of {fan.size} in all")
    path = path.reshape(-1, 2)
    return PlanShown(message.step, path, fan.reshape(cost.size, *path.shape), cost, violation, message.feasible)
