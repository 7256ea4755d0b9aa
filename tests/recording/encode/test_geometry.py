from dataclasses import replace
from math import atan2, cos, pi, sin

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan

from mjnav.motion.diff_drive import LIDAR_HEIGHT
from mjnav.recording.encode import geometry


def heading(quaternion) -> float:
    return 2.0 * atan2(quaternion.z, quaternion.w)


def test_the_tree_of_frames_leads_to_the_belief_by_way_of_odometry(made_up):
    record = made_up.record(3)
    odometry = np.array([1.5, -0.3, 2.9])
    record = replace(record, reading=replace(record.reading, odometry_pose=odometry))
    message = FrameTransforms.FromString(geometry.encode_transforms(record))
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
    assert tree["lidar"].translation.z == LIDAR_HEIGHT
    assert {t.timestamp.ToNanoseconds() for t in message.transforms} == {300_000_000}


def test_between_readings_only_the_truth_moves(made_up):
    record = made_up.record(3, reading=None)
    message = FrameTransforms.FromString(geometry.encode_transforms(record, epoch=10**18))
    assert [t.child_frame_id for t in message.transforms] == ["base_link_truth"]
    assert message.transforms[0].timestamp.ToNanoseconds() == 10**18 + 300_000_000


def matrix(x: float, y: float, theta: float) -> np.ndarray:
    return np.array([[cos(theta), -sin(theta), x], [sin(theta), cos(theta), y], [0.0, 0.0, 1.0]])


def test_beam_i_points_to_two_pi_i_over_the_number_less_pi(made_up):
    reading = made_up.record(1).reading
    scan = LaserScan.FromString(geometry.encode_scan(reading))
    angles = np.linspace(scan.start_angle, scan.end_angle, len(scan.ranges))
    np.testing.assert_allclose(angles, 2 * pi * np.arange(360) / 360 - pi, atol=1e-12)
    np.testing.assert_array_equal(np.array(scan.ranges), reading.scan)
    assert scan.frame_id == "lidar"
    assert scan.pose.orientation.w == 1.0


def test_a_scan_without_beams_is_an_empty_scan(made_up):
    reading = replace(made_up.record(1).reading, scan=np.zeros(0))
    assert len(LaserScan.FromString(geometry.encode_scan(reading)).ranges) == 0
