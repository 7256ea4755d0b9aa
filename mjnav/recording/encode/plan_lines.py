"""Part of /scene: the plan that the robot follows, where it would stand at its end, and the rollouts beside it."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from mjnav.messages import Array, PlanShown
from mjnav.recording.encode import wire
from mjnav.recording.encode.candidate_arcs import LEVEL_HEADERS, RESOLUTION, level_bounds, line_header
from mjnav.recording.encode.geometry import WORLD_FRAME, pose

FAN_POINTS = 5  # drawn of a rollout, evenly over its time, the last is its end
HEIGHT = 0.04  # [m]

_BLUE, _PALE_BLUE = Color(r=0.1, g=0.25, b=1.0, a=1.0), Color(r=0.1, g=0.25, b=1.0, a=0.35)
_RED, _PALE_RED = Color(r=0.9, g=0.1, b=0.1, a=1.0), Color(r=0.9, g=0.1, b=0.1, a=0.35)
_FEASIBLE, _INFEASIBLE = line_header(0.05, HEIGHT, _BLUE), line_header(0.05, HEIGHT, _RED)
_ENTITY = wire.delimited(2, WORLD_FRAME.encode()) + wire.delimited(3, b"plan")


def plan_entity(plan: PlanShown, radius: float) -> bytes:
    """The entity `plan`, but for time and lifetime: its fan by the order of cost, the plan, the robot at its end.

    A plan that is not feasible is red. `radius` is the robot's [m].
    """
    if not len(plan.path):
        return _ENTITY
    num, size, kept = len(plan.fan), len(plan.path), min(FAN_POINTS, len(plan.path))
    fan = plan.fan[:, np.linspace(0, size - 1, kept).astype(int)]
    corners = _points(np.concatenate([fan.reshape(-1, 2), plan.path]))
    parts, begin = [_ENTITY], 0
    for header, (first, last) in zip(LEVEL_HEADERS, pairwise(level_bounds(num)), strict=True):
        if first < last:
            end = begin + (last - first) * kept * wire.POINT_SIZE
            parts.append(wire.delimited(11, header + corners[begin:end] + _segments(last - first, kept)))
            begin = end
    header = _FEASIBLE if plan.feasible else _INFEASIBLE
    parts.append(wire.delimited(11, header + corners[begin:] + _segments(1, size)))
    x, y = plan.path[-1].tolist()
    stand = _STAND if plan.feasible else _RED_STAND
    parts.append(wire.delimited(10, stand.fill((x, y, 2.0 * radius, 2.0 * radius))))
    return b"".join(parts)


def _points(places: Array) -> bytes:
    """Field `points` of a line, for each of places (n, 2)."""
    table = wire.point_table(5, len(places))
    table["x"], table["y"] = (np.rint(places / RESOLUTION) * RESOLUTION).T
    return table.tobytes()


@lru_cache(maxsize=16)  # a few numbers of rollouts in a level, and the plan's
def _segments(num: int, size: int) -> bytes:
    """Field `indices` of a line: the segments of `num` paths of `size` points, one path after the other."""
    corners = np.arange(num * size, dtype="<u4").reshape(num, size)
    return wire.delimited(8, np.stack([corners[:, :-1], corners[:, 1:]], axis=-1).tobytes())


def _stand(color: Color) -> wire.Template:
    """A thin cylinder of which x, y, width and depth are open."""

    def encode(holes: Sequence[float]) -> bytes:
        x, y, width, depth = holes
        return CylinderPrimitive(
            pose=pose(x, y, 0.5 * HEIGHT),
            size=Vector3(x=width, y=depth, z=HEIGHT),
            bottom_scale=1.0,
            top_scale=1.0,
            color=color,
        ).SerializeToString()

    return wire.Template(encode, 4)


_STAND, _RED_STAND = _stand(_PALE_BLUE), _stand(_PALE_RED)
