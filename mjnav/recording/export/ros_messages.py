"""The log's messages as messages of ROS 2: poses, twists, scans and particles.

The definitions of these types are the same in every distribution from Humble to Lyrical.
"""

from collections.abc import Mapping, Sequence
from math import atan2, cos, isnan, sin
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.Log_pb2 import Log as Event
from rosbags.typesys.stores import ros2_humble as ros

from mjnav.geometry.distances import WHOLE_TURN
from mjnav.messages import Array
from mjnav.motion.unicycle import LIDAR_HEIGHT
from mjnav.recording.encode.geometry import LIDAR_FRAME, ROBOT_FRAME, TRUE_FRAME, WORLD_FRAME, rotation, time_ns
from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.encode.plan import decode_plan
from mjnav.scenarios.sensors import Lidar

_PLANAR = [0, 1, 5]  # x, y and the turn about z among the six coordinates of a pose


def stamp(nanoseconds: int) -> ros.builtin_interfaces__msg__Time:
    """Simulated time."""
    return ros.builtin_interfaces__msg__Time(*divmod(nanoseconds, 1_000_000_000))


def header(nanoseconds: int, frame: str = WORLD_FRAME) -> ros.std_msgs__msg__Header:
    """Stamped with simulated time."""
    return ros.std_msgs__msg__Header(stamp(nanoseconds), frame)


def _measured(message: Any) -> int:
    """The time stamp [ns] of a protobuf message."""
    return message.timestamp.ToNanoseconds()


def vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> ros.geometry_msgs__msg__Vector3:
    """A vector; components are zero by default."""
    return ros.geometry_msgs__msg__Vector3(x, y, z)


def same_vector(given: Any) -> ros.geometry_msgs__msg__Vector3:
    """Of a foxglove.Vector3."""
    return ros.geometry_msgs__msg__Vector3(given.x, given.y, given.z)


def same_turn(turn: Any) -> ros.geometry_msgs__msg__Quaternion:
    """Of a foxglove.Quaternion."""
    return ros.geometry_msgs__msg__Quaternion(turn.x, turn.y, turn.z, turn.w)


def same_point(point: Any) -> ros.geometry_msgs__msg__Point:
    """Of a foxglove.Point3 or Vector3."""
    return ros.geometry_msgs__msg__Point(point.x, point.y, point.z)


def planar_pose(x: float, y: float, heading: float) -> ros.geometry_msgs__msg__Pose:
    """On the floor."""
    turn = ros.geometry_msgs__msg__Quaternion(0.0, 0.0, sin(0.5 * heading), cos(0.5 * heading))
    return ros.geometry_msgs__msg__Pose(ros.geometry_msgs__msg__Point(x, y, 0.0), turn)


def _twist(v: float, omega: float) -> ros.geometry_msgs__msg__Twist:
    return ros.geometry_msgs__msg__Twist(vector(x=v), vector(z=omega))


def floats(values: Sequence[float | None]) -> list[float]:
    """With NaN for JSON's null."""
    return np.array(values, float).tolist()


def planar_covariance(matrix: Array) -> Array:
    """The six by six entries of ROS, row by row, from those of x, y and the turn about z, (3, 3)."""
    covariance = np.zeros((6, 6))
    covariance[np.ix_(_PLANAR, _PLANAR)] = matrix
    return covariance.ravel()


# --------------------------------------------------------------------------------------------- robot


def clock(nanoseconds: int) -> ros.rosgraph_msgs__msg__Clock:
    """The simulated time, for nodes with use_sim_time."""
    return ros.rosgraph_msgs__msg__Clock(stamp(nanoseconds))


def transforms(message: Any, _: int) -> ros.tf2_msgs__msg__TFMessage:
    """foxglove.FrameTransforms, but for what never changes: that is /tf_static."""
    return ros.tf2_msgs__msg__TFMessage(
        [
            _transform(_measured(moved), moved.parent_frame_id, moved.child_frame_id, moved.translation, moved.rotation)
            for moved in message.transforms
            if moved.child_frame_id != LIDAR_FRAME
        ]
    )


def mount(lidar: Lidar) -> ros.tf2_msgs__msg__TFMessage:
    """Where the lidar is on the robot."""
    x, y, yaw = lidar.mount.tolist()
    shift = vector(x, y, LIDAR_HEIGHT)
    return ros.tf2_msgs__msg__TFMessage([_transform(0, ROBOT_FRAME, LIDAR_FRAME, shift, rotation(yaw))])


def _transform(now: int, parent: str, child: str, shift: Any, turn: Any) -> ros.geometry_msgs__msg__TransformStamped:
    moved = ros.geometry_msgs__msg__Transform(same_vector(shift), same_turn(turn))
    return ros.geometry_msgs__msg__TransformStamped(header(now, parent), child, moved)


def truth(document: Mapping, now: int) -> ros.nav_msgs__msg__Odometry:
    """The true pose and twist of mjnav.RobotState; no covariance."""
    return ros.nav_msgs__msg__Odometry(
        header(now),
        TRUE_FRAME,
        ros.geometry_msgs__msg__PoseWithCovariance(planar_pose(*floats(document["pose"])), np.zeros(36)),
        ros.geometry_msgs__msg__TwistWithCovariance(_twist(*floats(document["twist"])), np.zeros(36)),
    )


def estimate(document: Mapping, now: int) -> ros.geometry_msgs__msg__PoseWithCovarianceStamped | None:
    """The believed pose of mjnav.RobotState; None without an estimate."""
    believed = document["estimate"]
    if believed is None:
        return None
    covariance = planar_covariance(np.array(believed["covariance"], float))
    pose = ros.geometry_msgs__msg__PoseWithCovariance(planar_pose(*floats(believed["mean"])), covariance)
    return ros.geometry_msgs__msg__PoseWithCovarianceStamped(header(now), pose)


def odometry(document: Mapping, _: int) -> ros.geometry_msgs__msg__TwistStamped:
    """The wheels' mean twist since the reading before."""
    twist = _twist(*floats([document["v"], document["omega"]]))
    return ros.geometry_msgs__msg__TwistStamped(header(time_ns(document["time"]), ROBOT_FRAME), twist)


def measured_pose(document: Mapping, _: int) -> ros.geometry_msgs__msg__PoseStamped:
    """The pose sensor's of mjnav.Odometry."""
    return ros.geometry_msgs__msg__PoseStamped(
        header(time_ns(document["time"])), planar_pose(*floats(document["pose"]))
    )


def gyro(document: Mapping, _: int) -> ros.sensor_msgs__msg__Imu:
    """The yaw rate; -1 marks orientation and acceleration as missing (sensor_msgs/Imu)."""
    (rate,) = floats([document["gyro"]])
    missing = np.zeros(9)
    missing[0] = -1.0
    return ros.sensor_msgs__msg__Imu(
        header=header(time_ns(document["time"]), ROBOT_FRAME),
        orientation=ros.geometry_msgs__msg__Quaternion(0.0, 0.0, 0.0, 1.0),
        orientation_covariance=missing,
        angular_velocity=vector(z=rate),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector(),
        linear_acceleration_covariance=missing,
    )


def command(document: Mapping, now: int) -> ros.geometry_msgs__msg__TwistStamped:
    """The command in force from now on."""
    twist = _twist(*floats([document["v"], document["omega"]]))
    return ros.geometry_msgs__msg__TwistStamped(header(now, ROBOT_FRAME), twist)


def plan(message: Any, now: int) -> ros.nav_msgs__msg__Path:
    """The plan that is followed, of mjnav.Plan; each pose is stamped with the time for which it is planned.

    Each heading is that of the way from the position before; the first is that of the way to the second.
    """
    found = decode_plan(message)
    headings = [atan2(dy, dx) for dx, dy in np.diff(found.path, axis=0).tolist()]
    headings = [*(headings[:1] or [0.0] * len(found.path)), *headings]
    poses = [
        ros.geometry_msgs__msg__PoseStamped(header(now + time_ns(number * found.step)), planar_pose(x, y, heading))
        for number, ((x, y), heading) in enumerate(zip(found.path.tolist(), headings, strict=True), start=1)
    ]
    return ros.nav_msgs__msg__Path(header(now), poses)


def event(message: Any, _: int) -> ros.rcl_interfaces__msg__Log:
    """foxglove.Log."""
    line = ros.rcl_interfaces__msg__Log
    level = {Event.INFO: line.INFO, Event.WARNING: line.WARN, Event.ERROR: line.ERROR}
    return line(
        stamp=stamp(_measured(message)),
        level=level.get(message.level, line.DEBUG),
        name=message.name,
        msg=message.message,
        file="",
        function="",
        line=0,
    )


def scan(message: Any, _: int, *, lidar: Lidar, period: float) -> ros.sensor_msgs__msg__LaserScan:
    """foxglove.LaserScan; a beam without a return has an infinite range (REP 117).

    A lidar that turns takes its beams one after the other; `period` [s] is that of scans that are taken at once.
    """
    angle = (message.end_angle - message.start_angle) / max(1, len(message.ranges) - 1)
    return ros.sensor_msgs__msg__LaserScan(
        header=header(_measured(message), message.frame_id),
        angle_min=message.start_angle,
        angle_max=message.end_angle,
        angle_increment=angle,
        time_increment=0.0 if lidar.rate is None else angle / (WHOLE_TURN * lidar.rate),
        scan_time=period if lidar.rate is None else 1.0 / lidar.rate,
        range_min=lidar.min_range,
        range_max=lidar.max_range,
        ranges=np.array(message.ranges, np.float32),
        intensities=np.zeros(0, np.float32),
    )


# --------------------------------------------------------------------------------- people, particles


def people(document: Mapping, now: int) -> ros.geometry_msgs__msg__PoseArray:
    """The position of each person who is there, facing its velocity."""
    states = [floats([*person["position"], *person["velocity"]]) for person in document["people"]]
    states = [state for state in states if not isnan(state[0])]
    return ros.geometry_msgs__msg__PoseArray(header(now), [planar_pose(x, y, atan2(vy, vx)) for x, y, vx, vy in states])


def detections(document: Mapping, now: int) -> ros.geometry_msgs__msg__PoseArray | None:
    """The detected positions; None where the tick had no reading."""
    if "detections" not in document:
        return None
    places = [place for place in map(floats, document["detections"]) if not isnan(place[0])]
    return ros.geometry_msgs__msg__PoseArray(header(now), [planar_pose(x, y, 0.0) for x, y in places])


def scan_detections(document: Mapping, now: int) -> ros.geometry_msgs__msg__PoseArray:
    """The positions of mjnav.Detections; their radii and covariances are shapes of /scene."""
    places = [floats(found["position"]) for found in document["detections"]]
    return ros.geometry_msgs__msg__PoseArray(header(now), [planar_pose(x, y, 0.0) for x, y in places])


def _table(cloud: Any) -> np.ndarray:
    """The particles of a cloud as float32, (n, columns)."""
    return np.stack(list(decode_particles(cloud).values()), axis=-1).astype("<f4")


def particle_poses(cloud: Any, _: int) -> ros.geometry_msgs__msg__PoseArray:
    """Particles whose first columns are x, y and heading, as arrows; without their weights."""
    poses = [planar_pose(*row) for row in _table(cloud)[:, :3].tolist()]
    return ros.geometry_msgs__msg__PoseArray(header(_measured(cloud), cloud.frame_id), poses)


def particles(cloud: Any, _: int) -> ros.sensor_msgs__msg__PointCloud2:
    """Every column of a foxglove.PointCloud, with z = 0 after x and y, which viewers require."""
    table = np.insert(_table(cloud), 2, 0.0, axis=1)
    names = [column.name for column in cloud.fields]
    names.insert(2, "z")
    field = ros.sensor_msgs__msg__PointField
    return ros.sensor_msgs__msg__PointCloud2(
        header=header(_measured(cloud), cloud.frame_id),
        height=1,
        width=len(table),
        fields=[field(name, 4 * i, field.FLOAT32, 1) for i, name in enumerate(names)],
        is_bigendian=False,
        point_step=4 * len(names),
        row_step=table.nbytes,
        data=table.reshape(-1).view(np.uint8),
        is_dense=bool(np.isfinite(table).all()),
    )
