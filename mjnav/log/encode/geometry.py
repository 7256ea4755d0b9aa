"""/tf, /robot/truth, /robot/estimate and /scan: transforms, poses and scans as Foxglove's messages.

Frames are those of REP 105: map -> odom -> base_link -> lidar, and beside them map -> base_link_truth. The robot's
odometry leads from odom to base_link, without jumps but with drift. From map to odom is the correction that brings
base_link to the mean of the belief. The transform from base_link to lidar is constant. Messages are stamped with
simulated time, or with wall time where `epoch` [ns] is added to it.

Parts of a message are dicts, from which protobuf builds a message in half the time that it takes to copy another one.

Source: https://ros.org/reps/rep-0105.html
"""

from collections.abc import Mapping
from math import cos, sin
from types import MappingProxyType
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame

from mjnav.geometry.angles import wrap
from mjnav.log.encode.protobuf import delimited
from mjnav.messages import Array, Reading, TickRecord, WorldState
from mjnav.scene.sensors import Lidar

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


def stamp(time: float, epoch: int = 0) -> Any:
    """Simulated time [s] as a google.protobuf.Timestamp."""
    seconds, nanos = divmod(time_ns(time, epoch), 1_000_000_000)
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


def _transform(time: Any, parent: str, child: str, placed: Array, z: float = 0.0) -> Any:
    """The pose (3,) of the frame `child` in `parent`, at height z, as a foxglove.FrameTransform."""
    x, y, heading = placed.tolist()
    return {
        "timestamp": time,
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": {"x": x, "y": y, "z": z},
        "rotation": rotation(heading),
    }


_ORIGIN = pose(0.0, 0.0)


def correction(believed: Array, odometry: Array) -> Array:
    """The pose (3,) of odom in the map, with base_link at `odometry` in odom and at `believed` in the map.

    From T_map,odom T_odom,base = T_map,base: theta = theta_b - theta_o, and p = p_b - R(theta) p_o.
    """
    (x, y, heading), (along, across, turned) = believed.tolist(), odometry.tolist()
    turn = wrap(heading - turned)
    c, s = cos(turn), sin(turn)
    return np.array([x - c * along + s * across, y - s * along - c * across, turn])


def encode_transforms(record: TickRecord, lidar: Lidar, epoch: int = 0) -> bytes:
    """foxglove.FrameTransforms: the truth, and after a reading where the robot is by its odometry and by its belief.

    The last one is the lidar's place on the robot.
    """
    data = encode_true_transform(record.truth, epoch)
    if (reading := record.reading) is None:
        return data
    time, moved = stamp(reading.time, epoch), []
    if record.belief is not None:
        corrected = correction(record.belief.mean, reading.odometry_pose)
        moved.append(_transform(time, WORLD_FRAME, ODOMETRY_FRAME, corrected))
    moved.append(_transform(time, ODOMETRY_FRAME, ROBOT_FRAME, reading.odometry_pose))
    moved.append(_transform(time, ROBOT_FRAME, LIDAR_FRAME, lidar.mount, lidar.height))
    return data + FrameTransforms(transforms=moved).SerializeToString()


def encode_true_transform(truth: WorldState, epoch: int = 0) -> bytes:
    """foxglove.FrameTransforms with map -> base_link_truth alone."""
    moved = _transform(stamp(truth.time, epoch), WORLD_FRAME, TRUE_FRAME, truth.robot_pose)
    return FrameTransforms(transforms=[moved]).SerializeToString()


def encode_pose(time: float, robot_pose: Array, epoch: int = 0) -> bytes:
    """foxglove.PoseInFrame: a pose (3,) in the world's frame."""
    x, y, heading = robot_pose.tolist()
    placed = pose(x, y, heading=heading)
    return PoseInFrame(timestamp=stamp(time, epoch), frame_id=WORLD_FRAME, pose=placed).SerializeToString()


def encode_scan(reading: Reading, lidar: Lidar, epoch: int = 0) -> bytes | None:
    """foxglove.LaserScan, stamped with the time of its first beam; None of a reading without a scan.

    The beams are evenly spread from the first one's angle to the last one's.
    """
    if not reading.scan.size:
        return None
    taken = reading.scan_times[0] if reading.scan_times.size else reading.time
    scan = LaserScan(
        timestamp=stamp(float(taken), epoch),
        frame_id=LIDAR_FRAME,
        pose=_ORIGIN,
        start_angle=float(lidar.angles[0]),
        end_angle=float(lidar.angles[-1]),
    )
    return scan.SerializeToString() + delimited(6, np.asarray(reading.scan, "<f8").tobytes())
