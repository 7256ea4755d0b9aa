"""/tf, /robot/truth and /robot/estimate: transforms and poses as Foxglove's messages.

Frames are those of REP 105: map -> odom -> base_link -> lidar, and beside them map -> base_link_truth. The robot's
odometry leads from odom to base_link, without jumps but with drift. From map to odom is the correction that brings
base_link to the mean of the belief. What is stamped is simulated time, or wall time where `epoch` [ns] is added to it.

Source: https://ros.org/reps/rep-0105.html
"""

from collections.abc import Mapping, Sequence
from math import cos, sin
from types import MappingProxyType

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, TickRecord, WorldState
from mjnav.recording.encode import wire

WORLD_FRAME = "map"
ODOMETRY_FRAME = "odom"
ROBOT_FRAME = "base_link"  # where the robot believes to be
LIDAR_FRAME = "lidar"
TRUE_FRAME = "base_link_truth"
# What logs called them before they had all of these frames.
OLD_FRAMES: Mapping[str, str] = MappingProxyType({"base_link": TRUE_FRAME, "base_link_estimated": ROBOT_FRAME})


def time_ns(time: float, epoch: int = 0) -> int:
    """Simulated time [s] as the whole nanoseconds that stamp a message, counted from an epoch [ns]."""
    return round(time * 1e9) + epoch


def stamp(time: float, epoch: int = 0) -> Timestamp:
    """Simulated time [s] as protobuf has it."""
    seconds, nanos = divmod(time_ns(time, epoch), 1_000_000_000)
    return Timestamp(seconds=seconds, nanos=nanos)


def rotation(heading: float) -> Quaternion:
    """The turn by `heading` [rad] about z."""
    return Quaternion(z=sin(0.5 * heading), w=cos(0.5 * heading))


def pose(x: float, y: float, z: float = 0.0, heading: float = 0.0) -> Pose:
    """A planar pose at height z."""
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=rotation(heading))


def _transform(parent: str, child: str) -> wire.Template:
    """foxglove.FrameTransform, but for its time; x, y and the rotation's z, w are open."""

    def encode(values: Sequence[float]) -> bytes:
        x, y, z, w = values
        return FrameTransform(
            parent_frame_id=parent,
            child_frame_id=child,
            translation=Vector3(x=x, y=y),
            rotation=Quaternion(z=z, w=w),
        ).SerializeToString()

    return wire.Template(encode, 4)


def _placed(values: Sequence[float]) -> bytes:
    """foxglove.PoseInFrame, but for its time, from x, y and the rotation's z, w."""
    x, y, z, w = values
    placed = Pose(position=Vector3(x=x, y=y), orientation=Quaternion(z=z, w=w))
    return PoseInFrame(frame_id=WORLD_FRAME, pose=placed).SerializeToString()


_TRUTH = _transform(WORLD_FRAME, TRUE_FRAME)
_CORRECTION = _transform(WORLD_FRAME, ODOMETRY_FRAME)
_ODOMETRY = _transform(ODOMETRY_FRAME, ROBOT_FRAME)
_PLACED = wire.Template(_placed, 4)


def _planar(robot_pose: Array) -> tuple[float, float, float, float]:
    """x, y and the rotation's z, w of a pose (3,)."""
    x, y, heading = robot_pose.tolist()
    return x, y, sin(0.5 * heading), cos(0.5 * heading)


def correction(believed: Array, odometry: Array) -> Array:
    """The pose (3,) of odom in the map, with base_link at `odometry` in odom and at `believed` in the map.

    From T_map,odom T_odom,base = T_map,base: theta = theta_b - theta_o, and p = p_b - R(theta) p_o.
    """
    (x, y, heading), (along, across, turned) = believed.tolist(), odometry.tolist()
    turn = wrap(heading - turned)
    c, s = cos(turn), sin(turn)
    return np.array([x - c * along + s * across, y - s * along - c * across, turn])


def encode_transforms(record: TickRecord, mount: bytes, epoch: int = 0) -> bytes:
    """foxglove.FrameTransforms: the truth, and after a reading where the robot is by its odometry and by its belief.

    `mount` is the lidar's place on the robot (`encode.scan.encode_mount`).
    """
    data = encode_true_transform(record.truth, epoch)
    if (reading := record.reading) is not None:
        time = wire.timestamp(1, time_ns(reading.time, epoch))
        if record.belief is not None:
            corrected = correction(record.belief.mean, reading.odometry_pose)
            data += wire.delimited(1, time + _CORRECTION.fill(_planar(corrected)))
        data += wire.delimited(1, time + _ODOMETRY.fill(_planar(reading.odometry_pose)))
        data += wire.delimited(1, time + mount)
    return data


def encode_true_transform(truth: WorldState, epoch: int = 0) -> bytes:
    """foxglove.FrameTransforms with map -> base_link_truth alone."""
    return wire.delimited(1, wire.timestamp(1, time_ns(truth.time, epoch)) + _TRUTH.fill(_planar(truth.robot_pose)))


def encode_pose(time: float, robot_pose: Array, epoch: int = 0) -> bytes:
    """foxglove.PoseInFrame: a pose (3,) in the world's frame."""
    return wire.timestamp(1, time_ns(time, epoch)) + _PLACED.fill(_planar(robot_pose))
