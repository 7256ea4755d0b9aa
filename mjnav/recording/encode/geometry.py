"""Poses, transforms, scans and particles as Foxglove's protobuf messages."""

from collections.abc import Sequence
from functools import lru_cache
from math import cos, pi, sin

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.PackedElementField_pb2 import PackedElementField
from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from mjnav.messages import Array, Reading, RobotBelief, Track, WorldState
from mjnav.recording.encode import wire

WORLD_FRAME = "map"
TRUE_FRAME = "base_link"
ESTIMATED_FRAME = "base_link_estimated"


def time_ns(time: float) -> int:
    """Simulated time [s] as the whole nanoseconds that stamp a message."""
    return round(time * 1e9)


def stamp(time: float) -> Timestamp:
    """Simulated time [s] as protobuf has it."""
    seconds, nanos = divmod(time_ns(time), 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


def rotation(heading: float) -> Quaternion:
    """The turn by `heading` [rad] about z."""
    return Quaternion(z=sin(0.5 * heading), w=cos(0.5 * heading))


def pose(x: float, y: float, z: float = 0.0, heading: float = 0.0) -> Pose:
    """A planar pose at height z."""
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=rotation(heading))


def _transform(name: str) -> wire.Template:
    """foxglove.FrameTransform from the map, but for its time; x, y and the rotation's z, w are open."""

    def encode(values: Sequence[float]) -> bytes:
        x, y, z, w = values
        return FrameTransform(
            parent_frame_id=WORLD_FRAME,
            child_frame_id=name,
            translation=Vector3(x=x, y=y),
            rotation=Quaternion(z=z, w=w),
        ).SerializeToString()

    return wire.Template(encode, 4)


def _placed(values: Sequence[float]) -> bytes:
    """foxglove.PoseInFrame, but for its time, from x, y and the rotation's z, w."""
    x, y, z, w = values
    placed = Pose(position=Vector3(x=x, y=y), orientation=Quaternion(z=z, w=w))
    return PoseInFrame(frame_id=WORLD_FRAME, pose=placed).SerializeToString()


_TRUE_TRANSFORM, _ESTIMATED_TRANSFORM = _transform(TRUE_FRAME), _transform(ESTIMATED_FRAME)
_PLACED = wire.Template(_placed, 4)


def _planar(robot_pose: Array) -> tuple[float, float, float, float]:
    """x, y and the rotation's z, w of a pose (3,)."""
    x, y, heading = robot_pose.tolist()
    return x, y, sin(0.5 * heading), cos(0.5 * heading)


def encode_transforms(truth: WorldState, belief: RobotBelief | None) -> bytes:
    """map -> base_link (truth) and, where there is a belief, map -> base_link_estimated (its mean)."""
    time = wire.timestamp(1, time_ns(truth.time))
    data = wire.delimited(1, time + _TRUE_TRANSFORM.fill(_planar(truth.robot_pose)))
    if belief is not None:
        data += wire.delimited(1, time + _ESTIMATED_TRANSFORM.fill(_planar(belief.mean)))
    return data


def encode_pose(time: float, robot_pose: Array) -> bytes:
    """foxglove.PoseInFrame: a pose (3,) in the world's frame."""
    return wire.timestamp(1, time_ns(time)) + _PLACED.fill(_planar(robot_pose))


_SCAN_POSE = wire.delimited(3, pose(0.0, 0.0).SerializeToString())


def encode_scan(reading: Reading) -> bytes:
    """The lidar's ranges in the true robot's frame; beam i of B points to 2 pi i / B - pi."""
    time = wire.timestamp(1, time_ns(reading.time))
    return time + _scan_header(reading.scan.size) + wire.packed_doubles(6, reading.scan)


@lru_cache(maxsize=8)
def _scan_header(beams: int) -> bytes:
    """foxglove.LaserScan, but for its time and ranges."""
    frame = wire.delimited(2, TRUE_FRAME.encode())
    return frame + _SCAN_POSE + wire.double(4, -pi) + wire.double(5, pi - 2.0 * pi / max(beams, 1))


def _cloud_header(names: tuple[str, ...]) -> bytes:
    """A cloud of float32 columns, but for its time and data."""
    fields = [
        PackedElementField(name=name, offset=4 * i, type=PackedElementField.FLOAT32) for i, name in enumerate(names)
    ]
    cloud = PointCloud(frame_id=WORLD_FRAME, pose=pose(0.0, 0.0), point_stride=4 * len(names), fields=fields)
    return cloud.SerializeToString()


_ROBOT_CLOUD = _cloud_header(("x", "y", "theta", "weight"))
_TRACKS_CLOUD = _cloud_header(("x", "y", "vx", "vy", "weight", "track"))


def encode_robot_particles(belief: RobotBelief) -> bytes:
    """Particles x, y, theta, weight; float32, for looking."""
    table = np.empty((belief.weights.size, 4), "<f4")
    table[:, :3] = belief.particles
    table[:, 3] = belief.weights
    return wire.timestamp(1, time_ns(belief.time)) + _ROBOT_CLOUD + wire.delimited(6, table.tobytes())


def encode_track_particles(time: float, tracks: tuple[Track, ...]) -> bytes:
    """Particles of all tracks x, y, vx, vy, weight and the track's place in the tuple; float32, for looking."""
    table = np.empty((sum(track.weights.size for track in tracks), 6), "<f4")
    states, weights, places = table[:, :4], table[:, 4], table[:, 5]
    first = 0
    for place, track in enumerate(tracks):
        last = first + track.weights.size
        states[first:last] = track.particles
        weights[first:last] = track.weights
        places[first:last] = place
        first = last
    return wire.timestamp(1, time_ns(time)) + _TRACKS_CLOUD + wire.delimited(6, table.tobytes())
