"""/tf, /robot/truth, /robot/estimate and /scan: transforms, poses and ranges as Foxglove's messages."""

from collections.abc import Sequence
from functools import lru_cache
from math import cos, pi, sin

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp

from mjnav.messages import Array, Reading, RobotBelief, WorldState
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
