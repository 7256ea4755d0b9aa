"""A ROS 2 bag: read back field by field, and by programs other than the one that wrote it."""

import json
from collections import Counter
from math import cos, isinf, pi, sin

import numpy as np
import pytest
from rosbags.interfaces import QosDurability, QosReliability
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from mjnav.recording.encode.particles import decode_particles
from mjnav.recording.encode.topics import topics
from mjnav.recording.export.export import export
from mjnav.recording.export.rosbag2 import TOPICS, ros_topics
from tests.recording.export.bags import assert_header, assert_pose, logged, pairs, same

LATER = (Stores.ROS2_IRON, Stores.ROS2_JAZZY, Stores.ROS2_KILTED, Stores.ROS2_LYRICAL)


# ------------------------------------------------------------------------------------------- the bag


def test_every_topic_of_a_log_is_in_the_bag(scenario):
    said_twice = {"/robot/truth", "/robot/estimate", "/candidates/arcs"}  # by /robot/state and /candidates
    assert set(TOPICS) == {topic.name for topic in topics(scenario)} - said_twice


def test_the_bags_description_is_what_is_in_it(log, folder, bag):
    with Reader(folder) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        assert counts == {topic: len(bag[topic]) for topic in counts}
        assert reader.message_count == sum(counts.values())
        assert {connection.ext.serialization_format for connection in reader.connections} == {"cdr"}
        quality = {connection.topic: connection.ext.offered_qos_profiles for connection in reader.connections}
        assert {profile.reliability for (profile,) in quality.values()} == {QosReliability.RELIABLE}
        latched = [topic for topic, (profile,) in quality.items() if profile.durability != QosDurability.VOLATILE]
        assert sorted(latched) == ["/map", "/scene", "/tf_static"]
        assert {quality[topic][0].durability for topic in latched} == {QosDurability.TRANSIENT_LOCAL}
    said = YAML(typ="safe").load(folder / "metadata.yaml")["rosbag2_bagfile_information"]
    assert said["custom_data"] == log.run
    assert (said["version"], said["storage_identifier"], said["relative_file_paths"]) == (8, "mcap", ["bag.mcap"])
    for part in (said, said["files"][0]):
        assert part["starting_time"] == {"nanoseconds_since_epoch": 0}
        assert part["duration"] == {"nanoseconds": 600_000_000}
        assert part["message_count"] == sum(counts.values())
    assert sorted(path.name for path in folder.iterdir()) == ["bag.mcap", "metadata.yaml"]


def test_its_types_are_the_same_in_every_distribution_since_humble(scenario):
    humble = get_typestore(Stores.ROS2_HUMBLE)
    types = {topic.type for group in ros_topics(scenario).values() for topic in group}
    assert len(types) >= 11
    for name in types | {"rosgraph_msgs/msg/Clock", "nav_msgs/msg/OccupancyGrid"}:
        for store in LATER:
            assert get_typestore(store).hash_rihs01(name) == humble.hash_rihs01(name)


def test_evos_error_of_the_bag_is_the_results(driven, tmp_path, tmp_path_factory, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path_factory.mktemp("home")))  # where evo keeps its settings
    from evo.core import metrics, sync
    from evo.tools import file_interface

    export(driven, "rosbag2", tmp_path / "bag")
    with Reader(tmp_path / "bag") as reader:
        pair = [file_interface.read_bag_trajectory(reader, f"/robot/{name}") for name in ("truth", "estimate")]
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data(sync.associate_trajectories(*pair))
    rmse = error.get_statistic(metrics.StatisticsType.rmse)
    assert rmse == pytest.approx(driven.result["localization_rmse_m"], abs=1e-12)


# ---------------------------------------------------------------------------------------- the robot


def test_the_truth_is_an_odometry_without_covariance(log, bag):
    for time, value, message in pairs(log, "/robot/state", bag, "/robot/truth"):
        assert_header(message.header, time)
        assert message.child_frame_id == "base_link_truth"
        assert_pose(message.pose.pose, *value["pose"])
        assert same(message.twist.twist.linear) == (value["twist"][0], 0.0, 0.0)
        assert same(message.twist.twist.angular) == (0.0, 0.0, value["twist"][1])
        assert not message.pose.covariance.any()
        assert not message.twist.covariance.any()


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


def test_odometry_becomes_a_turn_rate_and_a_measured_pose_too(log, bag):
    for time, value, message in pairs(log, "/odometry", bag, "/imu"):
        assert_header(message.header, time, "base_link")
        assert same(message.angular_velocity) == (0.0, 0.0, value["gyro"])
        assert message.orientation_covariance[0] == message.linear_acceleration_covariance[0] == -1.0
    for time, value, message in pairs(log, "/odometry", bag, "/measured_pose"):
        assert_header(message.header, time)
        assert_pose(message.pose, *value["pose"])


def test_a_scan_keeps_its_beams_and_their_infinities(log, bag):
    missed = 0
    for time, value, message in pairs(log, "/scan", bag, "/scan"):
        assert_header(message.header, time, "lidar")
        np.testing.assert_array_equal(message.ranges, np.array(value.ranges, np.float32))
        assert message.angle_min == np.float32(-pi)
        assert message.angle_increment == pytest.approx(2 * pi / 360)
        assert message.angle_max == pytest.approx(pi - 2 * pi / 360)
        assert message.scan_time == pytest.approx(1 / log.scenario().sensors.rate)
        assert (message.range_min, message.range_max) == (0.0, log.scenario().sensors.lidar_range)
        missed += sum(map(isinf, message.ranges))
    assert missed > 0


@pytest.mark.parametrize(("topic", "ros_topic"), [("/command", "/cmd_vel"), ("/odometry", "/odometry")])
def test_commands_and_odometry_are_stamped_twists(log, bag, topic, ros_topic):
    for time, value, message in pairs(log, topic, bag, ros_topic):
        assert_header(message.header, time, "base_link")
        assert same(message.twist.linear) == (value["v"], 0.0, 0.0)
        assert same(message.twist.angular) == (0.0, 0.0, value["omega"])


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
    for _, value, message in pairs(log, "/belief/robot", bag, "/belief/robot"):
        ours = np.stack([*decode_particles(value).values()], -1).astype(np.float32)
        assert len(message.poses) == 500
        for row, pose in zip(ours.tolist(), message.poses, strict=True):
            assert_pose(pose, *row[:3])


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
            lifetime = 200_000_000 if marker.ns.endswith("_estimate") else 0
            assert (marker.action, marker.lifetime.sec, marker.lifetime.nanosec) == (0, 0, lifetime)
            assert marker.color.a > 0
        entities = {entity.id: entity for entity in value.entities}
        for name in ("person0", "person1", "person2"):
            (marker, label) = [marker for marker in message.markers if marker.ns == name]
            (body,) = entities[name].cylinders
            assert same(marker.pose.position) == same(body.pose.position)
            assert same(marker.scale) == same(body.size)
            assert (marker.color.r, marker.color.g) == (np.float32(body.color.r), np.float32(body.color.g))
            assert (label.text, label.scale.z) == (name, pytest.approx(0.3))
        (left, _) = [marker for marker in message.markers if marker.ns == "lanes"]
        assert [same(point) for point in left.points] == [(0.0, 2.5, 0.0), (10.0, 2.5, 0.0)]
        assert left.scale.x == 0.05


def test_candidates_are_drawn_as_arcs_from_the_believed_pose(log, bag):
    states = dict(logged(log, "/robot/state"))
    for time, value, message in pairs(log, "/candidates", bag, "/candidates"):
        *thin, chosen = message.markers
        assert sum(len(marker.points) for marker in thin) == 4 * len(value.v)  # two segments each
        assert len(chosen.points) == 4
        x, y, _ = states[time]["estimate"]["mean"]
        assert same(chosen.points[0]) == pytest.approx((x, y, 0.0), abs=2**-11)
        assert chosen.scale.x > 5 * thin[0].scale.x


def test_topics_without_a_ros_type_are_json(log, bag):
    for topic in ("/contacts", "/decision", "/tick"):
        for _, value, message in pairs(log, topic, bag, topic):
            assert json.loads(message.data) == value
    for _, value, message in pairs(log, "/cone", bag, "/cone"):
        cone = json.loads(message.data)
        assert (cone["obstacle"], cone["safe_share"]) == ("person1", value.safe_share)
        np.testing.assert_array_equal(np.float32(cone["samples"]), np.array(value.samples, np.float32))


def test_events_are_lines_of_a_ros_log(log, bag):
    for time, value, message in pairs(log, "/events", bag, "/events"):
        assert (message.level, message.name, message.msg) == (30, "contact", value.message)
        assert message.stamp.sec * 10**9 + message.stamp.nanosec == time
