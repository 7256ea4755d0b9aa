"""Part of /scene: how the people closest to the robot are predicted to go on, a line a sample."""

from collections.abc import Sequence

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity

from mjnav.messages import Array, Observation, Track
from mjnav.recording.encode.geometry import WORLD_FRAME

MOST_PEOPLE = 3  # nearest first
MOST_SAMPLES = 8
HEIGHT = 0.04  # [m]
SUFFIX = "_future"  # of an entity's name, after the track's

_ORANGE = Color(r=1.0, g=0.6, b=0.1, a=0.5)


def future_entities(observation: Observation | None, tracks: Sequence[Track]) -> list[bytes]:
    """An entity `person0_future` each, but for time and lifetime; none where everybody is taken to walk straight on."""
    if observation is None or all(disc.future is None for disc in observation.obstacles):
        return []
    people = list(zip(tracks, observation.obstacles, strict=False))  # furniture follows the people
    robot = observation.robot_pose[:, :2].mean(axis=0)
    people.sort(key=lambda person: float(np.hypot(*(person[1].position.mean(axis=0) - robot))))
    return [
        _entity(track.name, np.concatenate([disc.position[:MOST_SAMPLES, None], disc.future[:MOST_SAMPLES]], axis=1))
        for track, disc in people[:MOST_PEOPLE]
        if disc.future is not None
    ]


def _entity(name: str, paths: Array) -> bytes:
    lines = [
        LinePrimitive(
            type=LinePrimitive.LINE_STRIP,
            thickness=2.0,
            scale_invariant=True,
            points=[Point3(x=x, y=y, z=HEIGHT) for x, y in path],
            color=_ORANGE,
        )
        for path in paths.tolist()
    ]
    entity = SceneEntity(frame_id=WORLD_FRAME, id=f"{name}{SUFFIX}", frame_locked=True, lines=lines)
    return entity.SerializeToString()
