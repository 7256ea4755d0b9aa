"""A ROS 2 bag: metadata.yaml and one MCAP file of CDR messages, for Humble and every later distribution.

Topics keep the log's names where ROS has no convention: /map, /tf, /tf_static, /odom, /scan, /imu and /cmd_vel are
called as nav2 calls them. Stamps are simulated time, which /clock carries too. Frames are those of REP 105, and
base_link_truth. A topic without a ROS type is JSON in a std_msgs/String. The run's metadata are the bag's custom data.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from google.protobuf.json_format import MessageToDict
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.stores.ros2_humble import std_msgs__msg__String as String

from mjnav.recording.export import ros_map, ros_markers, ros_messages, ros_odometry
from mjnav.recording.read.log import Log, LogMessage
from mjnav.scenarios.spec import Robot, Scenario

VERSION = 8  # of the metadata; Humble cannot read the quality of service as version 9 writes it
_NO_LIMIT = QosTime(0, 0)


def _quality(durability: QosDurability, depth: int) -> Qos:
    """Reliable, which reliable and best-effort subscribers accept."""
    history, reliability, liveliness = QosHistory.KEEP_LAST, QosReliability.RELIABLE, QosLiveliness.SYSTEM_DEFAULT
    return Qos(history, depth, reliability, durability, _NO_LIMIT, _NO_LIMIT, liveliness, _NO_LIMIT, False)


STREAM = _quality(QosDurability.VOLATILE, 10)
LATCHED = _quality(QosDurability.TRANSIENT_LOCAL, 1)  # a late subscriber gets the last one


@dataclass(frozen=True, slots=True)
class RosTopic:
    """A topic of the bag. `encode` makes its message, or None, of the log's message and its time [ns]."""

    name: str
    type: str
    encode: Callable[[Any, int], Any]
    quality: Qos = STREAM


def _as_text(value: Any, _: int) -> String:
    document = value if isinstance(value, dict) else MessageToDict(value, preserving_proto_field_name=True)
    return String(json.dumps(document))


def _text(name: str) -> RosTopic:
    return RosTopic(name, "std_msgs/msg/String", _as_text)


def ros_topics(scenario: Scenario) -> dict[str, tuple[RosTopic, ...]]:
    """The bag's topics by those of the log; the log's /robot/truth and /robot/estimate repeat /robot/state."""
    poses, cloud = "geometry_msgs/msg/PoseArray", "sensor_msgs/msg/PointCloud2"
    markers = "visualization_msgs/msg/MarkerArray"
    sensors, odometry = scenario.sensors, "nav_msgs/msg/Odometry"
    scan = partial(ros_messages.scan, lidar=sensors.scanner, period=1.0 / sensors.rate)

    def people(kind: str) -> list[RosTopic]:
        """A topic for each person: ROS has no list of odometries."""
        names = [f"person{i}" for i in range(len(scenario.people))]
        encoders = [partial(ros_odometry.person, name=name) for name in names]
        return [RosTopic(f"/people/{name}/{kind}", odometry, of) for name, of in zip(names, encoders, strict=True)]

    return {
        "/tf": (RosTopic("/tf", "tf2_msgs/msg/TFMessage", ros_messages.transforms),),
        "/robot/state": (
            RosTopic("/robot/truth", odometry, ros_messages.truth),
            RosTopic("/robot/estimate", "geometry_msgs/msg/PoseWithCovarianceStamped", ros_messages.estimate),
        ),
        "/people/truth": (RosTopic("/people/truth", poses, ros_messages.people), *people("truth")),
        "/people/estimate": (
            RosTopic("/people/estimate", poses, ros_messages.people),
            RosTopic("/people/detections", poses, ros_messages.detections),
            *people("estimate"),
        ),
        "/detections": (RosTopic("/detections", poses, ros_messages.scan_detections),),
        "/odometry": (
            RosTopic("/odom", odometry, ros_odometry.WheelOdometry(scenario)),
            RosTopic("/odometry", "geometry_msgs/msg/TwistStamped", ros_messages.odometry),
            RosTopic("/imu", "sensor_msgs/msg/Imu", ros_messages.gyro),
            RosTopic("/measured_pose", "geometry_msgs/msg/PoseStamped", ros_messages.measured_pose),
        ),
        "/scan": (RosTopic("/scan", "sensor_msgs/msg/LaserScan", scan),),
        "/command": (RosTopic("/cmd_vel", "geometry_msgs/msg/TwistStamped", ros_messages.command),),
        "/belief/robot": (
            RosTopic("/belief/robot", poses, ros_messages.particle_poses),
            RosTopic("/belief/robot/points", cloud, ros_messages.particles),
        ),
        "/belief/obstacles": (RosTopic("/belief/obstacles/points", cloud, ros_messages.particles),),
        "/scene": (RosTopic("/scene", markers, ros_markers.markers, LATCHED),),
        "/candidates": (RosTopic("/candidates", markers, ros_markers.candidate_markers),),
        "/plan": (RosTopic("/plan", "nav_msgs/msg/Path", ros_messages.plan),),
        "/events": (RosTopic("/events", "rcl_interfaces/msg/Log", ros_messages.event),),
        **{name: (_text(name),) for name in ("/contacts", "/decision", "/cone", "/tick")},
    }


TOPICS = tuple(ros_topics(Scenario("any", Robot(start=(0.0, 0.0, 0.0), goal=(1.0, 0.0)))))
_CLOCK = RosTopic("/clock", "rosgraph_msgs/msg/Clock", lambda _, now: ros_messages.clock(now))


def _latched(scenario: Scenario) -> tuple[RosTopic, ...]:
    """What is said once, at the beginning."""
    grid = RosTopic("/map", "nav_msgs/msg/OccupancyGrid", lambda _, now: ros_map.occupancy_grid(scenario), LATCHED)
    lidar = scenario.sensors.scanner
    mount = RosTopic("/tf_static", "tf2_msgs/msg/TFMessage", lambda _, now: ros_messages.mount(lidar), LATCHED)
    return (grid, mount)


def write(log: Log, topics: Sequence[str], messages: Iterator[LogMessage], folder: Path) -> dict[str, int]:
    """The bag; gives the number of messages in each of its topics. Its chunks are compressed with Zstandard."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    scenario = log.scenario()
    table, latched = ros_topics(scenario), _latched(scenario)
    writer = Writer(folder, version=VERSION, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    for key, value in (log.run or {}).items():
        writer.set_custom_data(key, value)
    with writer:
        counts: dict[str, int] = {}
        connections = {}
        for topic in (_CLOCK, *latched, *(topic for name in topics for topic in table[name])):
            connections[topic.name] = writer.add_connection(
                topic.name, topic.type, typestore=store, offered_qos_profiles=[topic.quality]
            )
            counts[topic.name] = 0
        now = -1
        for name, time_ns, _, value in messages:
            clock = (_CLOCK,) if time_ns > now else ()
            first, latched = latched, ()
            now = max(now, time_ns)
            for topic in (*clock, *first, *table[name]):
                if (message := topic.encode(value, time_ns)) is not None:
                    data = store.serialize_cdr(message, topic.type)
                    writer.write(connections[topic.name], time_ns, data)
                    counts[topic.name] += 1
    return counts
