"""Frames, odometry, people's motion and the map of a ROS 2 bag."""

from math import atan2, cos, hypot, sin

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from mjnav.motion.unicycle import LIDAR_HEIGHT, integrate
from mjnav.recording.export import ros_messages
from mjnav.recording.export.export import export
from mjnav.recording.export.ros_messages import built, moved_covariance, occupancy_grid
from mjnav.scenarios.sensors import LidarSpec
from mjnav.scenarios.spec import Robot, Scenario, Sensors
from mjnav.world.floor_plan import FloorPlan
from tests.recording.export.bags import assert_header, assert_pose, logged, pairs, same


def test_the_tree_of_frames_is_that_of_rep_105(log, bag):
    assert len(bag["/tf_static"]) == 1
    (mount,) = bag["/tf_static"][0][1].transforms
    assert (mount.header.frame_id, mount.child_frame_id, same(mount.transform.translation)) == (
        "base_link",
        "lidar",
        (0.0, 0.0, LIDAR_HEIGHT),
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
    scan = built("sensor_msgs/msg/LaserScan", ros_messages.scan(logged, 0, lidar=lidar, period=0.1))
    assert scan.time_increment * np.arange(1081) == pytest.approx(lidar.turn_offsets)
    assert (scan.scan_time, scan.range_min, scan.range_max) == (0.025, 0.1, 30.0)
    (mount,) = built("tf2_msgs/msg/TFMessage", ros_messages.mount(lidar)).transforms
    assert same(mount.transform.translation) == (0.1, 0.05, LIDAR_HEIGHT)
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


def test_the_covariance_of_odom_is_that_of_many_noisy_ways():
    twists, std = [(0.5, 0.4), (0.7, -0.2), (0.6, 0.9)] * 4, np.array([0.02, 0.05])
    covariance, pose, rng = np.zeros((3, 3)), np.zeros(3), np.random.default_rng(0)
    poses = np.zeros((20_000, 3))
    for twist in twists:
        pose = integrate(pose, *twist, 0.1)
        covariance = moved_covariance(covariance, np.diag(std**2), pose[2], *twist, 0.1)
        noisy = np.array(twist) + std * rng.normal(size=(len(poses), 2))
        poses = integrate(poses, noisy[:, 0], noisy[:, 1], 0.1)
    np.testing.assert_allclose(np.cov(poses.T), covariance, rtol=0.05, atol=2e-7)


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


def test_a_map_of_a_huge_room_is_coarser():
    scenario = Scenario("far", Robot(start=(0.0, 0.0, 0.0), goal=(9000.0, 9000.0)))
    grid = built("nav_msgs/msg/OccupancyGrid", occupancy_grid(scenario))
    assert max(grid.info.width, grid.info.height) <= 1001
    assert grid.info.resolution == pytest.approx(9003.0 / 999)


def test_each_person_has_an_odometry_with_its_speed_along_its_way(log, bag):
    for kind in ("truth", "estimate"):
        for name in ("person0", "person1", "person2"):
            found = dict(bag[f"/people/{name}/{kind}"])
            states = [(t, one) for t, v in logged(log, f"/people/{kind}") for one in v["people"] if one["name"] == name]
            states = [(time, one) for time, one in states if None not in one["position"]]
            assert list(found) == [time for time, _ in states]
            for time, one in states:
                message, (vx, vy) = found[time], one["velocity"]
                assert_header(message.header, time)
                assert message.child_frame_id == name
                heading = atan2(vy, vx)
                x, y = one["position"]
                assert_pose(message.pose.pose, x, y, heading)
                assert same(message.twist.twist.linear) == (hypot(vx, vy), 0.0, 0.0)
                twist = message.twist.covariance.reshape(6, 6)[:2, :2]
                turn = np.array([[cos(heading), -sin(heading)], [sin(heading), cos(heading)]])
                expected = np.array(one["covariance"])[2:, 2:] if kind == "estimate" else np.zeros((2, 2))
                np.testing.assert_allclose(turn @ twist @ turn.T, expected, atol=1e-12)
    assert len(bag["/people/person0/estimate"]) == 4  # one of six ticks is without this track, in another it is nowhere
