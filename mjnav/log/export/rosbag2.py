"""A ROS 2 bag: metadata.yaml and one MCAP file of CDR messages, for Humble and every later distribution.

Topics keep the log's names where ROS has no convention: /map, /tf, /tf_static, /odom, /scan, /imu and /cmd_vel are
called as nav2 calls them. Stamps are simulated time, which /clock carries too. Frames are those of REP 105, and
base_link_truth. A topic without a ROS type is JSON in a std_msgs/String. The run's metadata are the bag's custom data.

A function takes a message of the log and its time [ns] and gives the fields of the ROS message, nested as ROS has them;
a field that it leaves out is zero or empty. `built` makes the message of a type from them. The types are the same in
every distribution.

People are poses that face the way they walk: messages for people (people_msgs, derived_object_msgs) have to be built.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, pairwise
from math import atan2, isnan, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Log_pb2 import Log as Event
from google.protobuf.json_format import MessageToDict
from rosbags.interfaces import Nodetype, Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.stores.ros2_humble import rcl_interfaces__msg__Log as Line
from rosbags.typesys.stores.ros2_humble import sensor_msgs__msg__PointField as PointField
from rosbags.typesys.stores.ros2_humble import visualization_msgs__msg__Marker as Marker

from mjnav.geometry.distances import WHOLE_TURN
from mjnav.geometry.floor import FreeSpace
from mjnav.log.encode import geometry
from mjnav.log.encode.particles import decode_particles
from mjnav.log.encode.plan import decode_plan
from mjnav.log.read.log import Log, LogMessage
from mjnav.messages import Array
from mjnav.scene.map_file import FREE, OCCUPIED, UNKNOWN
from mjnav.scene.sensors import Lidar
from mjnav.scene.spec import Scenario
from mjnav.scene.ways import floor_of_robot

Fields = dict[str, Any]
Convert = Callable[[Any, int], Fields | None]  # from a message of the log and its time [ns]; None: no message

TYPES = get_typestore(Stores.ROS2_HUMBLE)


def built(kind: str, given: Any) -> Any:
    """The message of a type from its fields: a mapping, or an object such as a protobuf message with the same names."""
    definitions = TYPES.fielddefs[kind][1]
    fields = given if isinstance(given, Mapping) else {name: getattr(given, name) for name, _ in definitions}
    return TYPES.types[kind](**{name: _field(*form, fields.get(name)) for name, form in definitions})


def _field(node: Nodetype, form: Any, given: Any) -> Any:
    """A field's value; zero or empty for None."""
    if node == Nodetype.BASE:
        return {"string": "", "bool": False}.get(form[0], 0) if given is None else given
    if node == Nodetype.NAME:
        return built(form, {} if given is None else given)
    (item, kind), length = form
    if item == Nodetype.BASE:
        return np.zeros(length, kind[0]) if given is None else np.asarray(given, kind[0])
    return [built(kind, one) for one in given or ()]


def stamp(nanoseconds: int) -> Fields:
    """Simulated time."""
    seconds, nanos = divmod(nanoseconds, 1_000_000_000)
    return {"sec": seconds, "nanosec": nanos}


def header(nanoseconds: int, frame: str = geometry.WORLD_FRAME) -> Fields:
    """Stamped with simulated time."""
    return {"stamp": stamp(nanoseconds), "frame_id": frame}


def _measured(message: Any) -> int:
    """The time stamp [ns] of a protobuf message."""
    return message.timestamp.ToNanoseconds()


def _pose(x: float, y: float, heading: float) -> Fields:
    return {"position": {"x": x, "y": y}, "orientation": geometry.rotation(heading)}


def _twist(v: float, omega: float) -> Fields:
    return {"linear": {"x": v}, "angular": {"z": omega}}


def _floats(values: Sequence[float | None]) -> list[float]:
    """With NaN for JSON's null."""
    return np.array(values, float).tolist()


def _covariance(matrix: Any) -> Array:
    """The six by six entries of ROS, row by row, from those of x, y and the turn about z, (3, 3)."""
    covariance = np.zeros((6, 6))
    covariance[np.ix_([0, 1, 5], [0, 1, 5])] = np.array(matrix, float)
    return covariance.ravel()


# --------------------------------------------------------------------------------------------- robot


def transforms(message: Any, _: int) -> Fields:
    """foxglove.FrameTransforms, but for what never changes: that is /tf_static."""
    return {
        "transforms": [
            _transform(_measured(moved), moved.parent_frame_id, moved.child_frame_id, moved.translation, moved.rotation)
            for moved in message.transforms
            if moved.child_frame_id != geometry.LIDAR_FRAME
        ]
    }


def mount(lidar: Lidar) -> Fields:
    """Where the lidar is on the robot."""
    x, y, yaw = lidar.mount.tolist()
    shift = {"x": x, "y": y, "z": lidar.height}
    return {"transforms": [_transform(0, geometry.ROBOT_FRAME, geometry.LIDAR_FRAME, shift, geometry.rotation(yaw))]}


def _transform(now: int, parent: str, child: str, shift: Any, turn: Any) -> Fields:
    moved = {"translation": shift, "rotation": turn}
    return {"header": header(now, parent), "child_frame_id": child, "transform": moved}


def truth(document: Mapping, now: int) -> Fields:
    """The true pose and twist of mjnav.RobotState; no covariance."""
    return {
        "header": header(now),
        "child_frame_id": geometry.TRUE_FRAME,
        "pose": {"pose": _pose(*_floats(document["pose"]))},
        "twist": {"twist": _twist(*_floats(document["twist"]))},
    }


def estimate(document: Mapping, now: int) -> Fields | None:
    """The believed pose of mjnav.RobotState; None without an estimate."""
    if (believed := document["estimate"]) is None:
        return None
    pose = {"pose": _pose(*_floats(believed["mean"])), "covariance": _covariance(believed["covariance"])}
    return {"header": header(now), "pose": pose}


def wheel_odometry(document: Mapping, _: int, *, noise: Array) -> Fields:
    """The pose that the wheels' twists lead to from the start, and the last twist with its noise's covariance (3, 3).

    The pose's covariance is left out.
    """
    twist = _twist(*_floats([document["v"], document["omega"]]))
    return {
        "header": header(geometry.time_ns(document["time"]), geometry.ODOMETRY_FRAME),
        "child_frame_id": geometry.ROBOT_FRAME,
        "pose": {"pose": _pose(*_floats(document["odometry_pose"]))},
        "twist": {"twist": twist, "covariance": _covariance(noise)},
    }


def measured_pose(document: Mapping, _: int) -> Fields:
    """The pose sensor's of mjnav.Odometry."""
    return {"header": header(geometry.time_ns(document["time"])), "pose": _pose(*_floats(document["pose"]))}


def gyro(document: Mapping, _: int) -> Fields:
    """The yaw rate; -1 marks orientation and acceleration as missing (sensor_msgs/Imu)."""
    (rate,) = _floats([document["gyro"]])
    missing = [-1.0, *[0.0] * 8]
    return {
        "header": header(geometry.time_ns(document["time"]), geometry.ROBOT_FRAME),
        "orientation": geometry.rotation(0.0),
        "orientation_covariance": missing,
        "angular_velocity": {"z": rate},
        "linear_acceleration_covariance": missing,
    }


def command(document: Mapping, now: int) -> Fields:
    """The command in force from now on."""
    return {"header": header(now, geometry.ROBOT_FRAME), "twist": _twist(*_floats([document["v"], document["omega"]]))}


def plan(message: Any, now: int, *, delay: float) -> Fields:
    """The plan that is followed, of mjnav.Plan, from when the decision takes effect on, `delay` [s] from now.

    Each pose is stamped with the time for which it is planned.
    """
    found = decode_plan(message)
    return _path(found.path, now, delay, found.step)


def way(message: Mapping[str, Any], now: int) -> Fields:
    """The way that is planned to the goal, of mjnav.Way."""
    return _path(np.array(message["line"]), now)


def _path(points: Array, now: int, delay: float = 0.0, step: float = 0.0) -> Fields:
    """nav_msgs/Path of points (n, 2), each stamped `step` [s] after the one before, the first after `delay` and a step.

    Each heading is that of the way from the position before; the first is that of the way to the second.
    """
    headings = [atan2(dy, dx) for dx, dy in np.diff(points, axis=0).tolist()]
    headings = [*(headings[:1] or [0.0] * len(points)), *headings]
    poses = [
        {"header": header(now + geometry.time_ns(delay + number * step)), "pose": _pose(x, y, heading)}
        for number, ((x, y), heading) in enumerate(zip(points.tolist(), headings, strict=True), start=1)
    ]
    return {"header": header(now), "poses": poses}


def event(message: Any, _: int) -> Fields:
    """foxglove.Log."""
    level = {Event.INFO: Line.INFO, Event.WARNING: Line.WARN, Event.ERROR: Line.ERROR}.get(message.level, Line.DEBUG)
    return {"stamp": stamp(_measured(message)), "level": level, "name": message.name, "msg": message.message}


def scan(message: Any, _: int, *, lidar: Lidar, period: float) -> Fields:
    """foxglove.LaserScan; a beam without a return has an infinite range (REP 117).

    A lidar that turns takes its beams one after the other; `period` [s] is that of scans that are taken at once.
    """
    angle = (message.end_angle - message.start_angle) / max(1, len(message.ranges) - 1)
    return {
        "header": header(_measured(message), message.frame_id),
        "angle_min": message.start_angle,
        "angle_max": message.end_angle,
        "angle_increment": angle,
        "time_increment": 0.0 if lidar.rate is None else angle / (WHOLE_TURN * lidar.rate),
        "scan_time": period if lidar.rate is None else 1.0 / lidar.rate,
        "range_min": lidar.min_range,
        "range_max": lidar.max_range,
        "ranges": message.ranges,
    }


# --------------------------------------------------------------------------------- people, particles


def people(document: Mapping, now: int) -> Fields:
    """The position of each person who is there, facing its velocity."""
    states = [_floats([*person["position"], *person["velocity"]]) for person in document["people"]]
    poses = [_pose(x, y, atan2(vy, vx)) for x, y, vx, vy in states if not isnan(x)]
    return {"header": header(now), "poses": poses}


def detections(document: Mapping, now: int) -> Fields | None:
    """The positions detected, with identity or by a scan; None where the tick had no reading."""
    if "detections" not in document:
        return None
    places = [_floats(found["position"] if isinstance(found, dict) else found) for found in document["detections"]]
    return {"header": header(now), "poses": [_pose(x, y, 0.0) for x, y in places if not isnan(x)]}


def particles(cloud: Any, _: int) -> Fields:
    """Every column of a foxglove.PointCloud, with z = 0 after x and y, which viewers require."""
    table = np.stack(list(decode_particles(cloud).values()), axis=-1).astype("<f4")
    table = np.insert(table, 2, 0.0, axis=1)
    names = [column.name for column in cloud.fields]
    names.insert(2, "z")
    float32 = PointField.FLOAT32
    return {
        "header": header(_measured(cloud), cloud.frame_id),
        "height": 1,
        "width": len(table),
        "fields": [{"name": name, "offset": 4 * i, "datatype": float32, "count": 1} for i, name in enumerate(names)],
        "point_step": 4 * len(names),
        "row_step": table.nbytes,
        "data": table.reshape(-1).view(np.uint8),
        "is_dense": bool(np.isfinite(table).all()),
    }


# ----------------------------------------------------------------------------------- map and markers


def occupancy_grid(scenario: Scenario) -> Fields:
    """Walls, legs of tables and pillars in the frame map; people and lanes are not in it.

    A cell is occupied where its centre is at most half a diagonal from an obstacle, so that thin legs are not lost, and
    everything else is free. It is the map that the robot has: where it has none, all is unknown.
    """
    robot, known, own = scenario.robot, scenario.known_bodies, scenario.estimation.map
    space = FreeSpace.of(floor_of_robot(known.walls, known.tables, known.pillars), [robot.start[:2], *robot.route])
    occupied = space.clearance <= sqrt(0.5) * space.cell
    height, width = occupied.shape
    x, y = (centre - 0.5 * space.cell for centre in space.low)
    info = {"resolution": space.cell, "width": width, "height": height, "origin": _pose(x, y, 0.0)}
    cells = np.where(occupied, OCCUPIED, FREE if own is None or own.source != "lidar" else UNKNOWN)
    return {"header": header(0), "info": info, "data": cells.astype(np.int8).ravel()}


def markers(update: Any, now: int) -> Fields:
    """foxglove.SceneUpdate: the entity's name is the namespace, in which each message replaces the one before."""
    return {
        "markers": [
            {
                "header": header(now, entity.frame_id),
                "ns": entity.id,
                "id": number,
                "pose": shape.pose,
                "color": shape.color,
                "lifetime": stamp(entity.lifetime.ToNanoseconds()),
                "frame_locked": entity.frame_locked,
                **fields,
            }
            for entity in update.entities
            for number, (shape, fields) in enumerate(_shapes(entity))
        ]
    }


def _shapes(entity: Any) -> Iterator[tuple[Any, Fields]]:
    """The Foxglove primitives, each with what its kind of marker has."""
    for cube in entity.cubes:
        yield cube, {"type": Marker.CUBE, "scale": cube.size}
    for cylinder in entity.cylinders:
        yield cylinder, {"type": Marker.CYLINDER, "scale": cylinder.size}
    for arrow in entity.arrows:
        size = {"x": arrow.shaft_length + arrow.head_length, "y": arrow.head_diameter, "z": arrow.head_diameter}
        yield arrow, {"type": Marker.ARROW, "scale": size}
    for text in entity.texts:
        yield text, {"type": Marker.TEXT_VIEW_FACING, "scale": {"z": text.font_size}, "text": text.text}
    for line in entity.lines:
        corners = [end for ends in segments(line) for end in ends]
        yield line, {"type": Marker.LINE_LIST, "scale": {"x": line.thickness}, "points": corners}


def segments(line: Any) -> Iterator[tuple[Any, Any]]:
    """The two ends of each segment of a foxglove.LinePrimitive, in its own pose, one by one: few bytes may be many."""
    corners = (line.points[i] for i in line.indices) if line.indices else iter(line.points)
    if line.type == LinePrimitive.LINE_LIST:
        return zip(corners, corners, strict=True)
    if line.type == LinePrimitive.LINE_LOOP and (first := next(corners, None)) is not None:
        corners = chain((first,), corners, (first,))
    return pairwise(corners)


# ---------------------------------------------------------------------------------------------- bag

VERSION = 8  # of the metadata; Humble cannot read the quality of service as version 9 writes it
LATCHED = ("/map", "/tf_static", "/scene")  # a late subscriber gets the last one


class RosTopic(NamedTuple):
    """A topic of the bag, and how its messages are made."""

    name: str
    type: str
    convert: Convert


def ros_topics(scenario: Scenario) -> dict[str, tuple[RosTopic, ...]]:
    """The bag's topics by those of the log; the log's /robot/truth and /robot/estimate repeat /robot/state."""
    poses, cloud = "geometry_msgs/msg/PoseArray", "sensor_msgs/msg/PointCloud2"
    moving, text = "nav_msgs/msg/Odometry", "std_msgs/msg/String"
    channels = scenario.noise.distributions()
    noise = np.diag([channels["odometry.v"].std ** 2, 0.0, channels["odometry.omega"].std ** 2])
    plans = partial(plan, delay=scenario.control.expected_delay)
    scans = partial(scan, lidar=scenario.sensors.scanner, period=1.0 / scenario.sensors.rate)
    return {
        "/tf": (RosTopic("/tf", "tf2_msgs/msg/TFMessage", transforms),),
        "/robot/state": (
            RosTopic("/robot/truth", moving, truth),
            RosTopic("/robot/estimate", "geometry_msgs/msg/PoseWithCovarianceStamped", estimate),
        ),
        "/people/truth": (RosTopic("/people/truth", poses, people),),
        "/people/estimate": (
            RosTopic("/people/estimate", poses, people),
            RosTopic("/people/detections", poses, detections),
        ),
        "/detections": (RosTopic("/detections", poses, detections),),
        "/odometry": (
            RosTopic("/odom", moving, partial(wheel_odometry, noise=noise)),
            RosTopic("/imu", "sensor_msgs/msg/Imu", gyro),
            RosTopic("/measured_pose", "geometry_msgs/msg/PoseStamped", measured_pose),
        ),
        "/scan": (RosTopic("/scan", "sensor_msgs/msg/LaserScan", scans),),
        "/command": (RosTopic("/cmd_vel", "geometry_msgs/msg/TwistStamped", command),),
        "/belief/robot": (RosTopic("/belief/robot/points", cloud, particles),),
        "/belief/obstacles": (RosTopic("/belief/obstacles/points", cloud, particles),),
        "/scene": (RosTopic("/scene", "visualization_msgs/msg/MarkerArray", markers),),
        "/plan": (RosTopic("/plan", "nav_msgs/msg/Path", plans),),
        "/way": (RosTopic("/way", "nav_msgs/msg/Path", way),),
        "/events": (RosTopic("/events", "rcl_interfaces/msg/Log", event),),
        **{name: (RosTopic(name, text, _as_text),) for name in ("/contacts", "/decision", "/cone", "/tick")},
    }


def _as_text(value: Any, _: int) -> Fields:
    document = value if isinstance(value, dict) else MessageToDict(value, preserving_proto_field_name=True)
    return {"data": json.dumps(document)}


_CLOCK = RosTopic("/clock", "rosgraph_msgs/msg/Clock", lambda _, now: {"clock": stamp(now)})  # for use_sim_time


def _quality(topic: str) -> Qos:
    """Reliable, which reliable and best-effort subscribers accept."""
    durability, depth = (QosDurability.TRANSIENT_LOCAL, 1) if topic in LATCHED else (QosDurability.VOLATILE, 10)
    history, reliability, liveliness = QosHistory.KEEP_LAST, QosReliability.RELIABLE, QosLiveliness.SYSTEM_DEFAULT
    no_limit = QosTime(0, 0)
    return Qos(history, depth, reliability, durability, no_limit, no_limit, liveliness, no_limit, False)


def write(log: Log, messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The bag; gives the number of messages in each of its topics. Its chunks are compressed with Zstandard."""
    scenario = log.scenario()
    table = ros_topics(scenario)
    said_once = (
        RosTopic("/map", "nav_msgs/msg/OccupancyGrid", lambda _, now: occupancy_grid(scenario)),
        RosTopic("/tf_static", "tf2_msgs/msg/TFMessage", lambda _, now: mount(scenario.sensors.scanner)),
    )
    writer = Writer(folder, version=VERSION, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    for key, value in (log.run or {}).items():
        writer.set_custom_data(key, value)
    with writer:
        counts: dict[str, int] = {}
        connections = {}
        for topic in (_CLOCK, *said_once, *(topic for topics in table.values() for topic in topics)):
            connections[topic.name] = writer.add_connection(
                topic.name, topic.type, typestore=TYPES, offered_qos_profiles=[_quality(topic.name)]
            )
            counts[topic.name] = 0
        now = -1
        for name, time_ns, _, value in messages:
            clock = (_CLOCK,) if time_ns > now else ()
            first, said_once = said_once, ()
            now = max(now, time_ns)
            for topic in (*clock, *first, *table.get(name, ())):
                if (fields := topic.convert(value, time_ns)) is not None:
                    data = TYPES.serialize_cdr(built(topic.type, fields), topic.type)
                    writer.write(connections[topic.name], time_ns, data)
                    counts[topic.name] += 1
    return counts
