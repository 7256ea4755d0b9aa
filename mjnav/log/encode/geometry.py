"""/tf, /robot/truth, /robot/estimate and /scan: transforms, poses and scans as Foxglove's messages.

Frames are those of REP 105: map -> odom -> base_link -> lidar, and beside them map -> base_link_truth. The robot's
odometry leads from odom to base_link, without jumps but with drift. From map to odom is the correction that brings
base_link to the mean of the belief. The transform from base_link to lidar is constant. Messages are stamped with
simulated time.

Source: https://ros.org/reps/rep-0105.html
"""

from collections.abc import Sequence
from functools import cache, lru_cache
from math import cos, sin
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from mjnav.geometry.angles import wrap
from mjnav.log.encode.protobuf import delimited, numbered
from mjnav.messages import Array, Reading, TickRecord, WorldState
from mjnav.scene.sensors import Lidar

WORLD_FRAME = "map"
ODOMETRY_FRAME = "odom"
ROBOT_FRAME = "base_link"  # where the robot believes to be
LIDAR_FRAME = "lidar"
TRUE_FRAME = "base_link_truth"


def time_ns(time: float) -> int:
    """Simulated time [s] as the whole nanoseconds that stamp a message."""
    return round(time * 1e9)


def stamp(time: float) -> Any:
    """Simulated time [s] as a google.protobuf.Timestamp."""
    seconds, nanos = divmod(time_ns(time), 1_000_000_000)
    return {"seconds": seconds, "nanos": nanos}


def rotation(heading: float) -> Any:
    """The turn by `heading` [rad] about z as a foxglove.Quaternion."""
    return {"z": sin(0.5 * heading), "w": cos(0.5 * heading)}


def pose(x: float, y: float, z: float = 0.0, heading: float = 0.0) -> Any:
    """A planar pose at height z as a foxglove.Pose."""
    return {"position": {"x": x, "y": y, "z": z}, "orientation": rotation(heading)}


def cylinder(x: float, y: float, radius: float, height: float, color: Color) -> Any:
    """A foxglove.CylinderPrimitive that stands on the floor."""
    return {
        "pose": pose(x, y, 0.5 * height),
        "size": {"x": 2.0 * radius, "y": 2.0 * radius, "z": height},
        "bottom_scale": 1.0,
        "top_scale": 1.0,
        "color": color,
    }


@lru_cache(maxsize=64)  # all of a tick, and of the readings before it
def stamped(time: float) -> bytes:
    """Field 1 of a message that begins with its timestamp: simulated time [s]."""
    return PoseInFrame(timestamp=stamp(time)).SerializeToString()


def _turned(x: float, y: float, heading: float) -> tuple[float, float, float, float]:
    """x, y of a pose, and z, w of its quaternion."""
    return x, y, sin(0.5 * heading), cos(0.5 * heading)


@numbered
def _frame(parent: str, child: str, height: float, turned: Sequence[float]) -> FrameTransform:
    """The frame `child` in `parent`, but for its time."""
    x, y, z, w = turned
    place: Any = {"x": x, "y": y, "z": height}
    turn: Any = {"z": z, "w": w}
    return FrameTransform(parent_frame_id=parent, child_frame_id=child, translation=place, rotation=turn)


@numbered
def _pose_in_map(turned: Sequence[float]) -> PoseInFrame:
    x, y, z, w = turned
    placed: Any = {"position": {"x": x, "y": y}, "orientation": {"z": z, "w": w}}
    return PoseInFrame(frame_id=WORLD_FRAME, pose=placed)


@cache
def _mounted(x: float, y: float, yaw: float, height: float) -> bytes:
    return _frame(ROBOT_FRAME, LIDAR_FRAME, height, _turned(x, y, yaw))


@cache
def _scanner(start_angle: float, end_angle: float) -> bytes:
    scan = LaserScan(frame_id=LIDAR_FRAME, pose=pose(0.0, 0.0), start_angle=start_angle, end_angle=end_angle)
    return scan.SerializeToString()


def correction(believed: Array, odometry: Array) -> tuple[float, float, float]:
    """The pose of odom in the map, with base_link at `odometry` in odom and at `believed` in the map, both (3,).

    From T_map,odom T_odom,base = T_map,base: theta = theta_b - theta_o, and p = p_b - R(theta) p_o.
    """
    (x, y, heading), (along, across, turned) = believed.tolist(), odometry.tolist()
    turn = float(wrap(heading - turned))
    c, s = cos(turn), sin(turn)
    return x - c * along + s * across, y - s * along - c * across, turn


def encode_transforms(record: TickRecord, lidar: Lidar) -> bytes:
    """foxglove.FrameTransforms: the truth, and after a reading where the robot is by its odometry and by its belief.

    The last one is the lidar's place on the robot.
    """
    data = encode_true_transform(record.truth)
    if (reading := record.reading) is None:
        return data
    time, moved = stamped(reading.time), []
    if record.belief is not None:
        corrected = correction(record.belief.mean, reading.odometry_pose)
        moved.append(_frame(WORLD_FRAME, ODOMETRY_FRAME, 0.0, _turned(*corrected)))
    moved.append(_frame(ODOMETRY_FRAME, ROBOT_FRAME, 0.0, _turned(*reading.odometry_pose.tolist())))
    moved.append(_mounted(*lidar.mount.tolist(), lidar.height))
    return data + b"".join([delimited(1, time + transform) for transform in moved])


def encode_true_transform(truth: WorldState) -> bytes:
    """foxglove.FrameTransforms with map -> base_link_truth alone."""
    moved = _frame(WORLD_FRAME, TRUE_FRAME, 0.0, _turned(*truth.robot_pose.tolist()))
    return delimited(1, stamped(truth.time) + moved)


def encode_pose(time: float, robot_pose: Array) -> bytes:
    """foxglove.PoseInFrame: a pose (3,) in the world's frame."""
    return stamped(time) + _pose_in_map(_turned(*robot_pose.tolist()))


def encode_scan(reading: Reading, lidar: Lidar) -> bytes | None:
    """foxglove.LaserScan, stamped with the time of its first beam; None of a reading without a scan.

    The beams are evenly spread from the first one's angle to the last one's.
    """
    if not reading.scan.size:
        return None
    taken = float(reading.scan_times[0]) if reading.scan_times.size else reading.time
    scanner = _scanner(float(lidar.angles[0]), float(lidar.angles[-1]))
    return stamped(taken) + scanner + delimited(6, np.asarray(reading.scan, "<f8").tobytes())
