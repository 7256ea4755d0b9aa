"""A ROS 2 bag: metadata.yaml and one MCAP file of CDR messages, for Humble and every later distribution.

Topics keep the log's names where ROS has no convention: /map, /tf, /tf_static, /odom, /scan, /imu and /cmd_vel are
called as nav2 calls them. Stamps are simulated time, which /clock carries too. Frames are those of REP 105, and
base_link_truth. A topic without a ROS type is JSON in a std_msgs/String. The run's metadata are the bag's custom data.
"""

import json
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from google.protobuf.json_format import MessageToDict
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from mjnav.log.export import ros_messages as ros
from mjnav.log.read.log import Log, LogMessage
from mjnav.scene.spec import Robot, Scenario

VERSION = 8  # of the metadata; Humble cannot read the quality of service as version 9 writes it
LATCHED = ("/map", "/tf_static", "/scene")  # a late subscriber gets the last one


class RosTopic(NamedTuple):
    """A topic of the bag, and how its messages are made."""

    name: str
    type: str
    convert: ros.Convert


def ros_topics(scenario: Scenario) -> dict[str, tuple[RosTopic, ...]]:
    """The bag's topics by those of the log; the log's /robot/truth and /robot/estimate repeat /robot/state."""
    poses, cloud = "geometry_msgs/msg/PoseArray", "sensor_msgs/msg/PointCloud2"
    markers, odometry = "visualization_msgs/msg/MarkerArray", "nav_msgs/msg/Odometry"
    sensors = scenario.sensors
    scan = partial(ros.scan, lidar=sensors.scanner, period=1.0 / sensors.rate)
    names = [f"person{i}" for i in range(len(scenario.people))]  # a topic each: ROS has no list of odometries
    table = [
        ("/tf", "/tf", "tf2_msgs/msg/TFMessage", ros.transforms),
        ("/robot/state", "/robot/truth", odometry, ros.truth),
        ("/robot/state", "/robot/estimate", "geometry_msgs/msg/PoseWithCovarianceStamped", ros.estimate),
        ("/people/truth", "/people/truth", poses, ros.people),
        ("/people/estimate", "/people/estimate", poses, ros.people),
        ("/people/estimate", "/people/detections", poses, ros.detections),
        *(
            (f"/people/{kind}", f"/people/{name}/{kind}", odometry, partial(ros.person, name=name))
            for kind in ("truth", "estimate")
            for name in names
        ),
        ("/detections", "/detections", poses, ros.scan_detections),
        ("/odometry", "/odom", odometry, ros.WheelOdometry(scenario)),
        ("/odometry", "/odometry", "geometry_msgs/msg/TwistStamped", ros.odometry),
        ("/odometry", "/imu", "sensor_msgs/msg/Imu", ros.gyro),
        ("/odometry", "/measured_pose", "geometry_msgs/msg/PoseStamped", ros.measured_pose),
        ("/scan", "/scan", "sensor_msgs/msg/LaserScan", scan),
        ("/command", "/cmd_vel", "geometry_msgs/msg/TwistStamped", ros.command),
        ("/belief/robot", "/belief/robot", poses, ros.particle_poses),
        ("/belief/robot", "/belief/robot/points", cloud, ros.particles),
        ("/belief/obstacles", "/belief/obstacles/points", cloud, ros.particles),
        ("/scene", "/scene", markers, ros.markers),
        ("/candidates", "/candidates", markers, ros.candidate_markers),
        ("/plan", "/plan", "nav_msgs/msg/Path", ros.plan),
        ("/events", "/events", "rcl_interfaces/msg/Log", ros.event),
        *((name, name, "std_msgs/msg/String", _as_text) for name in ("/contacts", "/decision", "/cone", "/tick")),
    ]
    found: dict[str, tuple[RosTopic, ...]] = {}
    for logged, *topic in table:
        found[logged] = (*found.get(logged, ()), RosTopic(*topic))
    return found


def _as_text(value: Any, _: int) -> ros.Fields:
    document = value if isinstance(value, dict) else MessageToDict(value, preserving_proto_field_name=True)
    return {"data": json.dumps(document)}


TOPICS = tuple(ros_topics(Scenario("any", Robot(start=(0.0, 0.0, 0.0), goal=(1.0, 0.0)))))
_CLOCK = RosTopic("/clock", "rosgraph_msgs/msg/Clock", lambda _, now: {"clock": ros.stamp(now)})  # for use_sim_time


def _said_once(scenario: Scenario) -> tuple[RosTopic, ...]:
    """What is said at the beginning."""
    grid = RosTopic("/map", "nav_msgs/msg/OccupancyGrid", lambda _, now: ros.occupancy_grid(scenario))
    mount = RosTopic("/tf_static", "tf2_msgs/msg/TFMessage", lambda _, now: ros.mount(scenario.sensors.scanner))
    return (grid, mount)


def _quality(topic: str) -> Qos:
    """Reliable, which reliable and best-effort subscribers accept."""
    durability, depth = (QosDurability.TRANSIENT_LOCAL, 1) if topic in LATCHED else (QosDurability.VOLATILE, 10)
    history, reliability, liveliness = QosHistory.KEEP_LAST, QosReliability.RELIABLE, QosLiveliness.SYSTEM_DEFAULT
    no_limit = QosTime(0, 0)
    return Qos(history, depth, reliability, durability, no_limit, no_limit, liveliness, no_limit, False)


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The bag; gives the number of messages in each of its topics. Its chunks are compressed with Zstandard."""
    scenario = log.scenario()
    table, said_once = ros_topics(scenario), _said_once(scenario)
    writer = Writer(folder, version=VERSION, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    for key, value in (log.run or {}).items():
        writer.set_custom_data(key, value)
    with writer:
        counts: dict[str, int] = {}
        connections = {}
        for topic in (_CLOCK, *said_once, *(topic for name in topics for topic in table[name])):
            connections[topic.name] = writer.add_connection(
                topic.name, topic.type, typestore=ros.TYPES, offered_qos_profiles=[_quality(topic.name)]
            )
            counts[topic.name] = 0
        now = -1
        for name, time_ns, _, value in messages:
            clock = (_CLOCK,) if time_ns > now else ()
            first, said_once = said_once, ()
            now = max(now, time_ns)
            for topic in (*clock, *first, *table[name]):
                if (fields := topic.convert(value, time_ns)) is not None:
                    data = ros.TYPES.serialize_cdr(ros.built(topic.type, fields), topic.type)
                    writer.write(connections[topic.name], time_ns, data)
                    counts[topic.name] += 1
    return counts
