"""Encodes protobuf messages of points, transforms, poses and scans, in part directly as bytes.

Protobuf's wire format is written directly for what a tick repeats hundreds of times. A field is its tag
(number << 3 | wire type) and its value; a submessage is a tag, its length and its bytes; joining the bytes of messages
merges them. A point of two doubles has always the same length, so a table of points is one structured array, and a
message of which only some doubles change is bytes with holes. Building a message object for each point takes a hundred
times as long.

Source: https://protobuf.dev/programming-guides/encoding/

/tf, /robot/truth and /robot/estimate hold transforms and poses as Foxglove's messages. Frames are those of REP 105:
map -> odom -> base_link -> lidar, and beside them map -> base_link_truth. The robot's odometry leads from odom to
base_link, without jumps but with drift. From map to odom is the correction that brings base_link to the mean of the
belief. Messages are stamped with simulated time, or with wall time where `epoch` [ns] is added to it.

Source: https://ros.org/reps/rep-0105.html

/scan holds a foxglove.LaserScan: the ranges of a scan in the lidar's own frame. The transform to this frame from the
robot's is constant.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from math import cos, sin
from types import MappingProxyType

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.timestamp_pb2 import Timestamp
from numpy.typing import ArrayLike

from mjnav.geometry.angles import wrap
from mjnav.messages import Array, Reading, TickRecord, WorldState
from mjnav.motion.unicycle import LIDAR_HEIGHT
from mjnav.scene.sensors import Lidar

# ---------------------------------------------------------------------------------------- wire format


VARINT, FIXED64, LENGTH_DELIMITED = 0, 1, 2


def varint(value: int) -> bytes:
    """A non-negative integer, seven bits a byte."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


@lru_cache(maxsize=128)  # of a few dozen
def tag(number: int, wire_type: int) -> bytes:
    """The tag of field `number`."""
    return varint(number << 3 | wire_type)


def delimited(number: int, data: bytes) -> bytes:
    """Field `number` with a string, bytes, a submessage or packed numbers."""
    return tag(number, LENGTH_DELIMITED) + varint(len(data)) + data


def integer(number: int, value: int) -> bytes:
    """Field `number` with an integer of at most 64 bits, a bool or an enumeration's value."""
    return tag(number, VARINT) + varint(value % 2**64)


def double(number: int, value: float) -> bytes:
    """Field `number` with a double."""
    return tag(number, FIXED64) + struct.pack("<d", value)


@lru_cache(maxsize=8)  # the messages of a tick share a few
def timestamp(number: int, time_ns: int) -> bytes:
    """Field `number` with a google.protobuf.Timestamp."""
    seconds, nanos = divmod(time_ns, 1_000_000_000)
    return delimited(number, integer(1, seconds) + integer(2, nanos))


POINT = np.dtype(
    [("tag", "u1"), ("length", "u1"), ("x_tag", "u1"), ("x", "<f8"), ("y_tag", "u1"), ("y", "<f8")]
)  # without padding: NumPy pads only on request
POINT_SIZE = POINT.itemsize  # [bytes]


def point_table(number: int, num_points: int) -> np.ndarray:
    """Repeated field `number` (< 16) of foxglove.Point3, of dtype POINT; "x" and "y" are to be filled in.

    z = 0 is left out.
    """
    table = np.zeros(num_points, POINT)
    table["tag"] = number << 3 | LENGTH_DELIMITED
    table["length"] = POINT_SIZE - 2
    table["x_tag"] = 1 << 3 | FIXED64
    table["y_tag"] = 2 << 3 | FIXED64
    return table


class Template:
    """The bytes of a message of which only some doubles change.

    `encode` maps `num_holes` non-zero doubles to the message's bytes, in which each stands once and in their order.
    """

    def __init__(self, encode: Callable[[Sequence[float]], bytes], num_holes: int):
        marks = [1.0 + (i + 1) / 1024.0 for i in range(num_holes)]
        rest, layout = encode(marks), "<"
        self._pieces: list[bytes | float] = []
        for i, mark in enumerate(marks):
            before, found, rest = rest.partition(struct.pack("<d", mark))
            if not found:
                raise ValueError(f"hole {i} of {num_holes} is not in the message")
            self._pieces += [before, mark]
            layout += f"{len(before)}sd"
        self._pieces.append(rest)
        self._pack = struct.Struct(f"{layout}{len(rest)}s").pack

    def fill(self, values: Sequence[float]) -> bytes:
        """The message with these doubles, as many as there are holes; one that is 0 is written too."""
        pieces = self._pieces.copy()
        pieces[1::2] = values
        return self._pack(*pieces)


def packed_doubles(number: int, values: ArrayLike) -> bytes:
    """Packed repeated field `number` of doubles."""
    return delimited(number, np.asarray(values, "<f8").tobytes())


def packed_floats(number: int, values: ArrayLike) -> bytes:
    """Packed repeated field `number` of floats."""
    return delimited(number, np.asarray(values, "<f4").tobytes())


# ------------------------------------------------------------------------------- transforms and poses


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


def _transform(parent: str, child: str) -> Template:
    """foxglove.FrameTransform, but for its time; x, y and the rotation's z, w are open."""

    def encode(values: Sequence[float]) -> bytes:
        x, y, z, w = values
        return FrameTransform(
            parent_frame_id=parent,
            child_frame_id=child,
            translation=Vector3(x=x, y=y),
            rotation=Quaternion(z=z, w=w),
        ).SerializeToString()

    return Template(encode, 4)


def _placed(values: Sequence[float]) -> bytes:
    """foxglove.PoseInFrame, but for its time, from x, y and the rotation's z, w."""
    x, y, z, w = values
    placed = Pose(position=Vector3(x=x, y=y), orientation=Quaternion(z=z, w=w))
    return PoseInFrame(frame_id=WORLD_FRAME, pose=placed).SerializeToString()


_TRUTH = _transform(WORLD_FRAME, TRUE_FRAME)
_CORRECTION = _transform(WORLD_FRAME, ODOMETRY_FRAME)
_ODOMETRY = _transform(ODOMETRY_FRAME, ROBOT_FRAME)
_PLACED = Template(_placed, 4)


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
        time = timestamp(1, time_ns(reading.time, epoch))
        if record.belief is not None:
            corrected = correction(record.belief.mean, reading.odometry_pose)
            data += delimited(1, time + _CORRECTION.fill(_planar(corrected)))
        data += delimited(1, time + _ODOMETRY.fill(_planar(reading.odometry_pose)))
        data += delimited(1, time + mount)
    return data


def encode_true_transform(truth: WorldState, epoch: int = 0) -> bytes:
    """foxglove.FrameTransforms with map -> base_link_truth alone."""
    return delimited(1, timestamp(1, time_ns(truth.time, epoch)) + _TRUTH.fill(_planar(truth.robot_pose)))


def encode_pose(time: float, robot_pose: Array, epoch: int = 0) -> bytes:
    """foxglove.PoseInFrame: a pose (3,) in the world's frame."""
    return timestamp(1, time_ns(time, epoch)) + _PLACED.fill(_planar(robot_pose))


# ----------------------------------------------------------------------------------------------- scan


class ScanEncoder:
    """Encodes a lidar's scans. The beams are evenly spread from the first one's angle to the last one's."""

    def __init__(self, lidar: Lidar, epoch: int = 0):
        self._epoch = epoch
        start, end = lidar.angles[[0, -1]].tolist()
        origin = delimited(3, pose(0.0, 0.0).SerializeToString())
        self._header = delimited(2, LIDAR_FRAME.encode()) + origin + double(4, start) + double(5, end)

    def encode(self, reading: Reading) -> bytes | None:
        """foxglove.LaserScan, stamped with the time of its first beam; None of a reading without a scan."""
        if not reading.scan.size:
            return None
        taken = reading.scan_times[0] if reading.scan_times.size else reading.time
        time = timestamp(1, time_ns(float(taken), self._epoch))
        return time + self._header + packed_doubles(6, reading.scan)


def encode_mount(mount: Array) -> bytes:
    """foxglove.FrameTransform, but for its time: the lidar's frame in the robot's."""
    x, y, yaw = mount.tolist()
    shift = Vector3(x=x, y=y, z=LIDAR_HEIGHT)
    return FrameTransform(
        parent_frame_id=ROBOT_FRAME, child_frame_id=LIDAR_FRAME, translation=shift, rotation=rotation(yaw)
    ).SerializeToString()
