from dataclasses import replace
from math import pi

import numpy as np
import pytest
from foxglove_schemas_protobuf.LaserScan_pb2 import LaserScan

from mjnav.log.encode.geometry import ScanEncoder
from mjnav.scene.sensors import LidarSpec, Sensors


def test_beam_i_points_to_two_pi_i_over_the_number_less_pi(made_up):
    reading = made_up.record(1).reading
    scan = LaserScan.FromString(ScanEncoder(Sensors().scanner).encode(reading))
    angles = np.linspace(scan.start_angle, scan.end_angle, len(scan.ranges))
    np.testing.assert_allclose(angles, 2 * pi * np.arange(360) / 360 - pi, atol=1e-12)
    np.testing.assert_array_equal(np.array(scan.ranges), reading.scan)
    assert scan.frame_id == "lidar"
    assert scan.pose.orientation.w == 1.0
    assert scan.timestamp.ToNanoseconds() == 100_000_000


def test_a_scan_of_a_lidar_that_turns_has_the_field_of_view_and_the_time_of_its_first_beam(made_up):
    lidar = Sensors(lidar=LidarSpec("utm-30lx", beams=5)).scanner
    reading = replace(made_up.record(3).reading, scan=np.arange(5.0), scan_times=0.2 + 0.01 * np.arange(5))
    scan = LaserScan.FromString(ScanEncoder(lidar, epoch=10**18).encode(reading))
    assert np.linspace(scan.start_angle, scan.end_angle, 5) == pytest.approx(np.radians([-135, -67.5, 0, 67.5, 135]))
    assert scan.timestamp.ToNanoseconds() == 10**18 + 200_000_000


def test_of_a_reading_without_a_scan_nothing_is_written(made_up):
    assert ScanEncoder(Sensors().scanner).encode(replace(made_up.record(1).reading, scan=np.zeros(0))) is None
