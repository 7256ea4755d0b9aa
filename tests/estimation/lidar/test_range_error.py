"""An error that all ranges share, told by the map."""

import numpy as np
import pytest

from mjnav.estimation.base import assumed_noise
from mjnav.estimation.lidar.likelihood_field import put_right
from mjnav.estimation.lidar.scan import MotionHistory, TwistSensors, scan_points
from mjnav.geometry.distance_field import DistanceField
from mjnav.scenarios.spec import Noise, Physics, Pillar, Robot, Scenario, Wall
from mjnav.scenarios.ways import floor_of_lidar
from mjnav.world.simulator import Simulator

POSE = np.array([1.0, -0.5, 0.4])
ELSEWHERE = np.array([3.5, 0.5, 1.4])
SURE, UNSURE = 1e-6 * np.eye(3), 0.04 * np.eye(3)


@pytest.fixture(scope="module")
def room():
    corners = ((-6, -4), (6, -4), (6, 4), (-6, 4))
    scenario = Scenario(
        name="room",
        robot=Robot(start=tuple(POSE), goal=(5.0, 0.0)),
        walls=tuple(Wall(corners[i - 1], corners[i]) for i in range(4)),
        pillars=(Pillar((3.0, 1.0)),),
        noise=Noise("none"),
        physics=Physics("kinematic"),
    )
    history = MotionHistory(TwistSensors.of(assumed_noise(scenario), scenario.robot.limits))
    points = scan_points(Simulator(scenario, 0).sense()[0], history, scenario.sensors.scanner)
    return points, scenario.sensors.scanner, DistanceField.of(floor_of_lidar(scenario.known_bodies)).grid


@pytest.mark.parametrize("error", [-0.3, 0.08, 0.7])
def test_it_is_taken_off(room, error):
    points, lidar, grid = room
    wrong = points * (1.0 + error / np.hypot(*points.T))[:, None]
    np.testing.assert_allclose(put_right(wrong, lidar, POSE, SURE, grid), points, atol=0.02)


def test_nothing_is_taken_off_that_the_pose_may_explain_or_where_the_map_explains_nothing(room):
    points, lidar, grid = room
    wrong = points * (1.0 + 0.2 / np.hypot(*points.T))[:, None]
    for scan, pose, covariance in ((points, POSE, SURE), (wrong, POSE, UNSURE), (points, ELSEWHERE, SURE)):
        np.testing.assert_array_equal(put_right(scan, lidar, pose, covariance, grid), scan)
