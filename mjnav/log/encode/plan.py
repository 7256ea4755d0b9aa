"""Encodes what a method that plans ahead compared, and draws the plan and the predicted ways of people in /scene.

/plan holds the plan, its rollouts and the violations of its samples as arrays of float32: a metre to the micrometre,
half the bytes.

The entity `plan` of /scene draws the plan that the robot follows, where the robot would stand at the plan's end, and
the rollouts beside it.

The entity `way` of /scene draws the way that is planned to the goal (`[route]`).

The entities `..._future` of /scene draw how the people closest to the robot are predicted to go on, a line a sample.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity

from mjnav.geometry.angles import mean_position
from mjnav.log.encode.candidates import drawn_paths, line_header
from mjnav.log.encode.geometry import WORLD_FRAME, cylinder
from mjnav.log.encode.protobuf import Fields, Schema, encode_fields, numbered, protobuf_schema
from mjnav.messages import Observation, PlanShown, Track, Way

# ----------------------------------------------------------------------------------------------- plan


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


def encode_plan(plan: PlanShown) -> bytes:
    """mjnav.Plan."""
    return encode_fields(_PLAN, plan.step, plan.path, plan.fan, plan.fan_cost, plan.violation, plan.feasible)


def decode_plan(message: Any) -> PlanShown:
    """The inverse of `encode_plan`, from the decoded message. Raises ValueError where the sizes do not agree."""
    path, fan, cost, violation = (
        np.array(getattr(message, name), float) for name in ("path", "fan", "fan_cost", "violation")
    )
    if path.size % 2 or fan.size != cost.size * path.size:
        raise ValueError(f"a path of {path.size} numbers, {cost.size} rollouts of {fan.size} in all")
    path = path.reshape(-1, 2)
    return PlanShown(message.step, path, fan.reshape(cost.size, *path.shape), cost, violation, message.feasible)


# ---------------------------------------------------------------------------------- plan in the scene


FAN_POINTS = 5  # drawn of a rollout, evenly over its time, the last is its end
HEIGHT = 0.04  # [m]

_BLUE, _PALE_BLUE = Color(r=0.1, g=0.25, b=1.0, a=1.0), Color(r=0.1, g=0.25, b=1.0, a=0.35)
_RED, _PALE_RED = Color(r=0.9, g=0.1, b=0.1, a=1.0), Color(r=0.9, g=0.1, b=0.1, a=0.35)
_WAY = line_header(0.03, 0.5 * HEIGHT, Color(r=0.1, g=0.6, b=0.3, a=0.7))
_FEASIBLE, _INFEASIBLE = line_header(0.05, HEIGHT, _BLUE), line_header(0.05, HEIGHT, _RED)


def plan_entity(plan: PlanShown, radius: float) -> bytes:
    """The entity `plan`, but for time and lifetime: its fan by the order of cost, the plan, the robot at its end.

    A plan that is not feasible is red. `radius` is the robot's [m].
    """
    if not len(plan.path):
        return SceneEntity(frame_id=WORLD_FRAME, id="plan").SerializeToString()
    size = len(plan.path)
    kept = min(FAN_POINTS, size)
    fan = plan.fan[:, np.arange(kept) * (size - 1) // max(kept - 1, 1)]
    followed = drawn_paths(plan.path[np.newaxis], _FEASIBLE if plan.feasible else _INFEASIBLE)
    return _stand(radius, plan.feasible, plan.path[-1].tolist()) + drawn_paths(fan) + followed


@numbered
def _stand(radius: float, feasible: bool, place: Sequence[float]) -> SceneEntity:
    """The entity `plan` with nothing but the robot at (x, y)."""
    x, y = place
    stand = cylinder(x, y, radius, HEIGHT, _PALE_BLUE if feasible else _PALE_RED)
    return SceneEntity(frame_id=WORLD_FRAME, id="plan", cylinders=[stand])


def way_entity(way: Way) -> bytes:
    """The entity `way`, but for time and lifetime: the way that is planned to the goal."""
    entity = SceneEntity(frame_id=WORLD_FRAME, id="way")
    return entity.SerializeToString() + drawn_paths(way.line[np.newaxis], _WAY)


# ---------------------------------------------------------------------- predicted people in the scene


MOST_PEOPLE = 3  # nearest first
MOST_SAMPLES = 8
SUFFIX = "_future"  # of an entity's name, after the track's

_ORANGE = Color(r=1.0, g=0.6, b=0.1, a=0.5)


def future_entities(observation: Observation | None, tracks: Sequence[Track]) -> list[bytes]:
    """An entity `person0_future` each, but for time and lifetime; none where everybody is taken to walk straight on."""
    if observation is None or all(disc.future is None for disc in observation.obstacles):
        return []
    people = list(zip(tracks, observation.obstacles, strict=False))  # furniture follows the people
    robot = mean_position(observation.robot_pose)
    people.sort(key=lambda person: float(np.hypot(*(person[1].position.mean(axis=0) - robot))))
    return [
        _strips(track.name, len(paths), paths.ravel().tolist())
        for track, disc in people[:MOST_PEOPLE]
        if disc.future is not None
        for paths in [np.concatenate([disc.position[:MOST_SAMPLES, None], disc.future[:MOST_SAMPLES]], axis=1)]
    ]


@numbered
def _strips(name: str, n: int, numbers: Sequence[float]) -> SceneEntity:
    """The entity of a person with `n` paths, by x, y of all of their points."""
    lines = [
        LinePrimitive(
            type=LinePrimitive.LINE_STRIP,
            thickness=2.0,
            scale_invariant=True,
            points=[Point3(x=x, y=y, z=HEIGHT) for x, y in path],
            color=_ORANGE,
        )
        for path in np.reshape(numbers, (n, -1, 2)).tolist()
    ]
    return SceneEntity(frame_id=WORLD_FRAME, id=f"{name}{SUFFIX}", frame_locked=True, lines=lines)
