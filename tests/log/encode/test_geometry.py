from dataclasses import replace
from math import atan2, cos, pi, sin

import numpy as np
import pytest
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan

from mjnav.log.encode import geometry
from mjnav.scene.sensors import LidarSpec, Sensors

LIDAR = Sensors(lidar=LidarSpec(mount=(0.1, -0.05, 0.3), height=0.21)).scanner


def heading(quaternion) -> float:
    return 2.0 * atan2(quaternion.z, quaternion.w)


def test_the_tree_of_frames_leads_to_the_belief_by_way_of_odometry(made_up):
    record = made_up.record(3)
    odometry = np.array([1.5, -0.3, 2.9])
    record = replace(record, reading=replace(record.reading, odometry_pose=odometry))
    message = FrameTransforms.FromString(geometry.encode_transforms(record, LIDAR))
    tree = {t.child_frame_id: t for t in message.transforms}
    assert {child: t.parent_frame_id for child, t in tree.items()} == {
        "base_link_truth": "map",
        "odom": "map",
        "base_link": "odom",
        "lidar": "base_link",
    }
    poses = {child: matrix(t.translation.x, t.translation.y, heading(t.rotation)) for child, t in tree.items()}
    np.testing.assert_allclose(poses["odom"] @ poses["base_link"], matrix(*record.belief.mean), atol=1e-12)
    np.testing.assert_allclose(poses["base_link_truth"], matrix(*record.truth.robot_pose), atol=1e-12)
    np.testing.assert_allclose(poses["base_link"], matrix(*odometry), atol=1e-12)
    np.testing.assert_allclose(poses["lidar"], matrix(0.1, -0.05, 0.3), atol=1e-12)
    assert tree["lidar"].translation.z == 0.21
    assert {t.timestamp.ToNanoseconds() for t in message.transforms} == {300_000_000}


def matrix(x: float, y: float, theta: float) -> np.ndarray:
    return np.array([[cos(theta), -sin(theta), x], [sin(theta), cos(theta), y], [0.0, 0.0, 1.0]])


def test_beam_i_points_to_two_pi_i_over_the_number_less_pi(made_up):
    reading = made_up.record(1).reading
    scan = LaserScan.FromString(geometry.encode_scan(reading, Sensors().scanner))
    angles = np.linspace(scan.start_angle, scan.end_angle, len(scan.ranges))
    np.testing.assert_allclose(angles, 2 * pi * np.arange(360) / 360 - pi, atol=1e-12)
    np.testing.assert_array_equal(np.array(scan.ranges), reading.scan)
    assert scan.frame_id == "lidar"
    assert scan.pose.orientation.w == 1.0
    assert scan.timestamp.ToNanoseconds() == 100_000_000


def test_a_scan_of_a_lidar_that_turns_has_the_field_of_view_and_the_time_of_its_first_beam(made_up):
    lidar = Sensors(lidar=LidarSpec("utm-30lx", beams=5)).scanner
    reading = replace(made_up.record(3).reading, scan=np.arange(5.0), scan_times=0.2 + 0.01 * np.arange(5))
    scan = LaserScan.FromString(geometry.encode_scan(reading, lidar))
    assert np.linspace(scan.start_angle, scan.end_angle, 5) == pytest.approx(np.radians([-135, -67.5, 0, 67.5, 135]))
    assert scan.timestamp.ToNanoseconds() == 200_000_000
