"""The likelihood of a scan, against the mixture written out with the exact distance of every end."""

import numpy as np
import pytest

from mjnav.geometry.distance_field import DistanceField
from mjnav.geometry.distances import beam_angles
from mjnav.geometry.floor import Floor
from mjnav.noise import profile
from mjnav.robot.estimation.lidar.likelihood_field import (
    LOG_CONTRADICTION,
    MODEL_STD,
    SHORT_RATE,
    Z_HIT,
    Z_RANDOM,
    Z_SHORT,
    LikelihoodField,
    contradictions,
    put_right,
    ways_of,
)
from mjnav.scene.sensors import LidarSpec, lidar_of

NOISE = profile("pearson")["lidar.range"]
LIDAR = lidar_of(LidarSpec(), 90, 10.0)
# A wall ahead with its faces at x = 2.95 and 3.05, and a pillar to the left.
FLOOR = Floor(np.array([[0.0, 2.0, 0.25]]), np.array([[3.0, 0.0, 0.0, 1.0, 4.0, 0.05]]))
FIELD = LikelihoodField.of(FLOOR, LIDAR, NOISE)


def literal(pose, points):
    """sum over beams of log(p(r | pose) / p(r | no surface)), with the exact distance to the surface that is met."""
    total = 0.0
    c, s = np.cos(pose[2]), np.sin(pose[2])
    for x, y in points[np.isfinite(points[:, 0])]:
        end = np.array([pose[0] + c * x - s * y, pose[1] + s * x + c * y])
        wall = end[0] - 2.95  # seen from the left: from its near face
        pillar = np.hypot(end[0], end[1] - 2.0) - 0.25
        d = wall if abs(wall) < abs(pillar) else pillar
        r = np.hypot(x, y)
        variance = NOISE.std**2 + MODEL_STD**2
        hit = np.exp(-0.5 * d * d / variance) / np.sqrt(2.0 * np.pi * variance)
        short = SHORT_RATE * np.exp(-SHORT_RATE * r) / (1.0 - np.exp(-SHORT_RATE * 10.0))
        other = Z_SHORT * short + Z_RANDOM / 10.0
        total += np.log((Z_HIT * hit + other) / other)
    return total


def test_it_is_the_mixture_of_hits_short_and_random_readings():
    rng = np.random.default_rng(1)
    y = np.linspace(-1.5, 1.5, 12)
    points = np.vstack([np.column_stack([2.95 + 0.03 * rng.standard_normal(12), y]), [[0.0, 1.76], [1.0, 0.3]]])
    points = np.vstack([points, np.full((3, 2), np.nan)])
    poses = np.array([[0.0, 0.0, 0.0], [0.04, 0.0, 0.0], [-0.1, 0.05, 0.03], [0.0, 0.4, -0.2], [1.0, -1.0, 2.0]])
    expected = [literal(pose, points) for pose in poses]
    assert FIELD.log_ratio(poses, FIELD.beams(points)) == pytest.approx(expected, rel=2e-2, abs=0.2)


def test_the_far_face_of_a_wall_explains_nothing():
    points = np.column_stack([np.full(20, 3.0), np.linspace(-1.0, 1.0, 20)])
    beams = FIELD.beams(points)
    near, far = FIELD.log_ratio(np.array([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]]), beams)
    assert near > 60.0
    assert far < 0.25 * near  # it is 0.1 m off, three standard deviations


def test_beams_that_would_have_gone_through_a_surface_speak_against_a_pose():
    points = np.column_stack([np.full(30, 4.0), np.linspace(-1.0, 1.0, 30)])
    ways = ways_of(points, FIELD, 30)
    (free, blocked), shares = contradictions(np.array([[-6.0, 0.0, 0.0], [0.0, 0.0, 0.0]]), ways, FIELD)
    assert shares.tolist() == [0.0, 1.0]
    assert free == 0.0
    assert blocked == pytest.approx(30 * LOG_CONTRADICTION)  # none of the ends lies on a surface
    nothing = ways_of(np.full((90, 2), np.nan), FIELD, 90)
    assert contradictions(np.array([[0.0, 0.0, 0.0]]), nothing, FIELD)[0][0] <= 8 * LOG_CONTRADICTION


POSE, ELSEWHERE = np.array([2.2, 2.0, 0.4]), np.array([3.5, 2.7, 1.4])
SURE, UNSURE = 1e-6 * np.eye(3), 0.04 * np.eye(3)


@pytest.fixture(scope="module")
def scan(room, ranges):
    """Points of a scan of the room from POSE, and the map's field."""
    angles = beam_angles(360)
    points = ranges(room, POSE)[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    return points, DistanceField.of(room).grid


@pytest.mark.parametrize("error", [-0.3, 0.08, 0.7])
def test_an_error_that_all_ranges_share_is_taken_off(scan, error):
    points, grid = scan
    wrong = points * (1.0 + error / np.hypot(*points.T))[:, None]
    np.testing.assert_allclose(put_right(wrong, LIDAR, POSE, SURE, grid), points, atol=0.02)
