"""A ROS 2 bag: read back field by field, and by programs other than the one that wrote it."""

from collections import Counter
from dataclasses import replace
from math import atan2, cos, sin

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from mjnav.log.encode.particles import decode_particles
from mjnav.log.encode.plan import encode_plan, plan_schema
from mjnav.log.export import rosbag2
from mjnav.log.export.export import export
from mjnav.log.export.rosbag2 import built, occupancy_grid
from mjnav.log.read.log import decoder
from mjnav.loop.prepare import load_scenario
from mjnav.motion.unicycle import integrate
from mjnav.scene.sensors import LidarSpec
from mjnav.scene.spec import Latency, Sensors
from mjnav.world.floor_plan import FloorPlan


def logged(log, topic):
    """Time [ns] and value of each of the log's messages."""
    return [(message.time_ns, message.value) for message in log.messages(topic)]


def pairs(log, topic, bag, ros_topic):
    """The log's values with the bag's messages, which have the same times."""
    ours, theirs = logged(log, topic), bag[ros_topic]
    assert [time for time, _ in ours] == [time for time, _ in theirs]
    assert ours
    return [(time, value, message) for (time, value), (_, message) in zip(ours, theirs, strict=True)]


def assert_header(header, time_ns: int, frame: str = "map") -> None:
    assert (header.stamp.sec, header.stamp.nanosec, header.frame_id) == (*divmod(time_ns, 10**9), frame)


def assert_pose(pose, x: float, y: float, heading: float) -> None:
    p, q = pose.position, pose.orientation
    assert (p.x, p.y, p.z) == (x, y, 0.0)
    assert (q.x, q.y, q.z, q.w) == (0.0, 0.0, sin(heading / 2), cos(heading / 2))


def same(vector) -> tuple[float, ...]:
    return vector.x, vector.y, vector.z


# ------------------------------------------------------------------------------------------- the bag


def test_the_bags_description_is_what_is_in_it(log, folder, bag):
    with Reader(folder) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        assert counts == {topic: len(bag[topic]) for topic in counts}
        quality = {connection.topic: connection.ext.offered_qos_profiles for connection in reader.connections}
        assert {profile.reliability for (profile,) in quality.values()} == {QosReliability.RELIABLE}
        latched = [topic for topic, (profile,) in quality.items() if profile.durability != QosDurability.VOLATILE]
        assert sorted(latched) == ["/map", "/scene", "/tf_static"]
    said = YAML(typ="safe").load(folder / "metadata.yaml")["rosbag2_bagfile_information"]
    assert said["custom_data"] == log.run
    assert (said["version"], said["storage_identifier"], said["relative_file_paths"]) == (8, "mcap", ["bag.mcap"])
    for part in (said, said["files"][0]):
        assert part["starting_time"] == {"nanoseconds_since_epoch": 0}
        assert part["duration"] == {"nanoseconds": 600_000_000}
        assert part["message_count"] == sum(counts.values())
    assert sorted(path.name for path in folder.iterdir()) == ["bag.mcap", "metadata.yaml"]


# ---------------------------------------------------------------------------------------- the robot


def test_the_estimates_covariance_is_that_of_x_y_and_yaw(log, bag):
    believed = [(time, value["estimate"]) for time, value in logged(log, "/robot/state") if value["estimate"]]
    assert len(believed) == len(bag["/robot/estimate"]) == 6
    for (time, estimate), (stamp, message) in zip(believed, bag["/robot/estimate"], strict=True):
        assert stamp == time
        assert_header(message.header, time)
        assert_pose(message.pose.pose, *estimate["mean"])
        covariance = message.pose.covariance.reshape(6, 6)
        for i, row in zip((0, 1, 5), estimate["covariance"], strict=True):
            assert [covariance[i, 0], covariance[i, 1], covariance[i, 5]] == row
        assert np.count_nonzero(covariance) == np.count_nonzero(estimate["covariance"])


# ------------------------------------------------------------------------------- people and particles


def test_people_who_are_there_face_the_way_they_walk(log, bag):
    for topic in ("/people/truth", "/people/estimate"):
        for time, value, message in pairs(log, topic, bag, topic):
            assert_header(message.header, time)
            there = [person for person in value["people"] if None not in person["position"]]
            for person, pose in zip(there, message.poses, strict=True):
                assert [pose.position.x, pose.position.y] == person["position"]
                turn = 2 * np.arctan2(pose.orientation.z, pose.orientation.w)
                speed = np.hypot(*person["velocity"])
                assert [speed * cos(turn), speed * sin(turn)] == pytest.approx(person["velocity"], abs=1e-12)
    places = [value["detections"] for _, value in logged(log, "/people/estimate") if "detections" in value]
    found = [[[pose.position.x, pose.position.y] for pose in message.poses] for _, message in bag["/people/detections"]]
    assert found == places
    assert len(places) == 5


def test_particles_keep_every_column(log, bag):
    for topic, columns in [("/belief/robot", "x y z theta weight"), ("/belief/obstacles", "x y z vx vy weight track")]:
        names = columns.split()
        for time, value, message in pairs(log, topic, bag, f"{topic}/points"):
            assert_header(message.header, time)
            assert [field.name for field in message.fields] == names
            assert [field.offset for field in message.fields] == list(range(0, 4 * len(names), 4))
            table = message.data.view("<f4").reshape(message.width, len(names))
            assert (message.point_step, message.row_step) == (4 * len(names), table.nbytes)
            assert not table[:, 2].any()
            ours = np.stack([*decode_particles(value).values()], -1).astype(np.float32)
            np.testing.assert_array_equal(np.delete(table, 2, axis=1), ours)


# ---------------------------------------------------------------------------- frames, motion and map


def test_the_tree_of_frames_is_that_of_rep_105(log, bag):
    assert len(bag["/tf_static"]) == 1
    (mount,) = bag["/tf_static"][0][1].transforms
    assert (mount.header.frame_id, mount.child_frame_id, same(mount.transform.translation)) == (
        "base_link",
        "lidar",
        (0.0, 0.0, 0.33),
    )
    for _, value, message in pairs(log, "/tf", bag, "/tf"):
        moving = [moved for moved in value.transforms if moved.child_frame_id != "lidar"]
        assert len(moving) in (1, 3)
        for ours, theirs in zip(moving, message.transforms, strict=True):
            assert_header(theirs.header, ours.timestamp.ToNanoseconds(), ours.parent_frame_id)
            assert theirs.child_frame_id == ours.child_frame_id
            assert same(theirs.transform.translation) == same(ours.translation)
            assert theirs.transform.rotation.z == ours.rotation.z


def test_a_lidar_that_turns_says_when_it_took_each_beam_and_where_it_stands():
    lidar = Sensors(lidar=LidarSpec("utm-30lx", mount=(0.1, 0.05, 0.4))).scanner
    start, end = lidar.angles[[0, -1]]
    logged = LaserScan(start_angle=start, end_angle=end, ranges=[1.0] * 1081)
    scan = built("sensor_msgs/msg/LaserScan", rosbag2.scan(logged, 0, lidar=lidar, period=0.1))
    assert scan.time_increment * np.arange(1081) == pytest.approx(lidar.turn_offsets)
    assert (scan.scan_time, scan.range_min, scan.range_max) == (0.025, 0.1, 30.0)
    (mount,) = built("tf2_msgs/msg/TFMessage", rosbag2.mount(lidar)).transforms
    assert same(mount.transform.translation) == (0.1, 0.05, 0.33)
    assert 2.0 * atan2(mount.transform.rotation.z, mount.transform.rotation.w) == pytest.approx(0.4)


def test_odom_is_where_the_wheels_lead_with_the_variance_of_their_noise(driven, tmp_path):
    export(driven, "rosbag2", tmp_path / "bag")
    with Reader(tmp_path / "bag") as reader:
        store = get_typestore(Stores.ROS2_JAZZY)
        odometry = [store.deserialize_cdr(data, c.msgtype) for c, _, data in reader.messages() if c.topic == "/odom"]
        tf = [store.deserialize_cdr(data, c.msgtype) for c, _, data in reader.messages() if c.topic == "/tf"]
    documents = [value for _, value in logged(driven, "/odometry")]
    assert len(odometry) == len(documents) > 10
    noise, pose = driven.scenario().noise.distributions(), np.zeros(3)
    for value, message, moved in zip(documents, odometry, tf[: len(odometry)], strict=True):
        pose = integrate(pose, value["v"], value["omega"], value["interval"])
        assert value["odometry_pose"] == pose.tolist()
        assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
        assert_pose(message.pose.pose, *pose.tolist())
        (by_odometry,) = [t.transform for t in moved.transforms if t.child_frame_id == "base_link"]
        assert same(by_odometry.translation) == same(message.pose.pose.position)
        assert (message.twist.twist.linear.x, message.twist.twist.angular.z) == (value["v"], value["omega"])
        twist = message.twist.covariance.reshape(6, 6)
        assert twist[0, 0] == noise["odometry.v"].std ** 2
        assert twist[5, 5] == noise["odometry.omega"].std ** 2
        assert np.count_nonzero(twist) == 2


def test_the_map_has_every_obstacle_and_nothing_else(log, bag):
    ((_, message),) = bag["/map"]
    info, scenario = message.info, log.scenario()
    assert_header(message.header, 0)
    assert info.resolution == np.float32(0.05)
    cells = message.data.reshape(info.height, info.width)
    assert set(np.unique(cells)) == {0, 100}
    x = info.origin.position.x + (np.arange(info.width) + 0.5) * 0.05
    y = info.origin.position.y + (np.arange(info.height) + 0.5) * 0.05
    plan = FloorPlan.of(scenario)
    for i in range(0, info.height, 3):
        for j in range(0, info.width, 3):
            assert (cells[i, j] == 100) == (plan.distance(x[j], y[i]) <= 0.05 * np.sqrt(0.5)), (x[j], y[i])
    for leg in scenario.tables[0].legs:
        assert cells[np.argmin(np.abs(y - leg[1])), np.argmin(np.abs(x - leg[0]))] == 100


@pytest.mark.parametrize(("source", "values"), [("lidar", {-1}), ("both", {0, 100})])
def test_a_robot_without_a_map_has_one_that_is_all_unknown(source, values):
    grid = occupancy_grid(load_scenario("hall-lidar", {"estimation.map.source": source}))
    assert set(grid["data"].tolist()) == values


# --------------------------------------------------------------------------------- markers and words


def test_the_scene_is_drawn_with_markers(log, bag):
    box, cylinder, arrow, lines, text = 1, 3, 0, 5, 9
    tracks = {time: len(value["people"]) for time, value in logged(log, "/people/estimate")}
    for time, value, message in pairs(log, "/scene", bag, "/scene"):
        kinds, believed = Counter(marker.type for marker in message.markers), tracks.get(time, 0)
        assert kinds == {box: 4, cylinder: 15 + believed, arrow: 1 + believed, lines: 2, text: 3}
        assert len({(marker.ns, marker.id) for marker in message.markers}) == len(message.markers)
        for marker in message.markers:
            assert_header(marker.header, time, "base_link_truth" if marker.ns == "robot" else "map")
            assert marker.lifetime.nanosec == (200_000_000 if marker.ns.endswith("_estimate") else 0)
            assert marker.color.a > 0
        (marker, label) = [marker for marker in message.markers if marker.ns == "person1"]
        (body,) = next(entity for entity in value.entities if entity.id == "person1").cylinders
        assert same(marker.pose.position) == same(body.pose.position)
        assert same(marker.scale) == same(body.size)
        assert (marker.color.r, label.text) == (np.float32(body.color.r), "person1")
        (left, _) = [marker for marker in message.markers if marker.ns == "lanes"]
        assert [same(point) for point in left.points] == [(0.0, 2.5, 0.0), (10.0, 2.5, 0.0)]


@pytest.mark.parametrize(
    ("control", "delay"),
    [
        ({}, 0.1),  # [s] of a decision that takes effect one period later
        ({"delay": 3}, 0.3),
        ({"latency": Latency(trace=(0.02, 0.04, 0.05))}, 0.04),
        ({"prediction": False}, 0.0),
    ],
)
def test_a_plan_begins_when_its_decision_takes_effect(made_up, scenario, control, delay):
    scenario = replace(scenario, control=replace(scenario.control, **control))
    (topic,) = rosbag2.ros_topics(scenario)["/plan"]
    message = decoder(plan_schema())(encode_plan(made_up.plan(num_steps=3)))
    path = built(topic.type, topic.convert(message, 5_000_000_000))
    assert_header(path.header, 5_000_000_000)
    for number, pose in enumerate(path.poses, start=1):
        assert_header(pose.header, 5_000_000_000 + round(1e9 * (delay + 0.2 * number)))


def test_a_planned_way_is_a_path_whose_poses_face_along_it():
    line = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]
    message = built("nav_msgs/msg/Path", rosbag2.way({"tick": 3, "number": 0, "line": line, "drawn": []}, 5))
    assert_header(message.header, 5)
    for pose, (x, y), heading in zip(message.poses, line, (0.0, 0.0, np.pi / 2), strict=True):
        assert_header(pose.header, 5)
        assert_pose(pose.pose, x, y, heading)
