from dataclasses import replace
from math import atan2, pi

import numpy as np
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan

from mjnav.recording.encode import geometry


def heading(quaternion) -> float:
    return 2.0 * atan2(quaternion.z, quaternion.w)


def test_transforms_name_the_truth_and_the_estimate(made_up):
    record = made_up.record(3)
    message = FrameTransforms.FromString(geometry.encode_transforms(record.truth, record.belief))
    assert [t.child_frame_id for t in message.transforms] == ["base_link", "base_link_estimated"]
    for transform, pose in zip(message.transforms, (record.truth.robot_pose, record.belief.mean), strict=True):
        assert transform.parent_frame_id == "map"
        assert (transform.translation.x, transform.translation.y) == (pose[0], pose[1])
        np.testing.assert_allclose(heading(transform.rotation), pose[2], atol=1e-12)
    assert (message.transforms[0].timestamp.seconds, message.transforms[0].timestamp.nanos) == (0, 300_000_000)


def test_beam_i_points_to_two_pi_i_over_the_number_less_pi(made_up):
    reading = made_up.record(1).reading
    scan = LaserScan.FromString(geometry.encode_scan(reading))
    angles = np.linspace(scan.start_angle, scan.end_angle, len(scan.ranges))
    np.testing.assert_allclose(angles, 2 * pi * np.arange(360) / 360 - pi, atol=1e-12)
    np.testing.assert_array_equal(np.array(scan.ranges), reading.scan)
    assert scan.frame_id == "base_link"
    assert scan.pose.orientation.w == 1.0


def test_a_scan_without_beams_is_an_empty_scan(made_up):
    reading = replace(made_up.record(1).reading, scan=np.zeros(0))
    assert len(LaserScan.FromString(geometry.encode_scan(reading)).ranges) == 0
