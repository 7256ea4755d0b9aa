"""Matches of scans with a map, and the Kalman filter that is corrected by them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from mjnav.geometry.angles import wrap
from mjnav.geometry.distance_field import DistanceField
from mjnav.geometry.distances import beam_angles
from mjnav.messages import Reading, RobotLimits
from mjnav.motion.unicycle import integrate
from mjnav.noise import profile
from mjnav.robot.estimation.kalman import Gaussian, pose_given, pose_moved
from mjnav.robot.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.robot.estimation.lidar.localizer import FloorSearch
from mjnav.robot.estimation.lidar.scan import TwistSensors
from mjnav.robot.estimation.lidar.scan_matching import (
    UNKNOWN,
    DelayedPose,
    Motion,
    ScanMatchingLocalizer,
    match_scan,
    normal_equations,
)
from mjnav.scene.sensors import Sensors

ANGLES = beam_angles(360)
POSE = np.array([3.0, 1.5, 0.4])
STD = 0.03  # [m] of a range


def points_of(ranges):
    """In the robot's frame, NaN where a beam met nothing."""
    return np.where(np.isfinite(ranges), ranges, np.nan)[:, None] * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])


def error_of(found, pose):
    error = found - pose
    error[2] = wrap(error[2])
    return error


@pytest.fixture(scope="module")
def field(room):
    return DistanceField.of(room, 0.025)


@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (0.08, -0.06, 0.05), (-0.1, 0.1, -0.1), (0.15, 0.0, 0.08)])
def test_a_scan_without_noise_gives_the_pose_to_a_millimetre(room, field, ranges, off):
    match = match_scan(field, points_of(ranges(room, POSE)), np.full(360, 0.01), POSE + off)
    assert np.abs(error_of(match.pose, POSE)).max() < 1e-3
    assert match.num_points == 360
    assert match.explained > 0.98


def test_along_a_corridor_the_guess_stays_and_its_variance_is_large(corridor, ranges):
    field = DistanceField.of(corridor)
    pose = np.array([0.0, 0.8, 0.2])
    guess = pose + np.array([0.3, 0.05, -0.05])
    match = match_scan(field, points_of(ranges(corridor, pose)), np.full(360, STD), guess)
    assert match.pose == pytest.approx([guess[0], pose[1], pose[2]], abs=2e-3)
    std = np.sqrt(np.diagonal(match.covariance))
    assert std[0] == pytest.approx(UNKNOWN, rel=0.01)
    assert std[1:].max() < 0.01
    assert np.linalg.eigvalsh(match.covariance).min() > 0.0


def test_the_gradient_is_that_of_the_robust_cost(room, field, ranges):
    points, t, m = points_of(ranges(room, POSE))[::7].copy(), 0.05, 9.0

    def cost(pose):
        """sum m e^2 / (m + e^2) / 2, whose derivative by e is w e."""
        c, s = np.cos(pose[2]), np.sin(pose[2])
        squared = (field.clearance(pose[:2] + points @ np.array([[c, s], [-s, c]])) / t) ** 2
        return 0.5 * (m * squared / (m + squared)).sum()

    pose = POSE + np.array([-0.013, 0.017, 0.004])
    # Ranges without an error: the variance is the map's, the same everywhere.
    hessian, gradient, _ = normal_equations(points, np.zeros(len(points)), pose, field.grid, t**2, m, np.inf)
    h = 1e-7
    numeric = [(cost(pose + h * axis) - cost(pose - h * axis)) / (2.0 * h) for axis in np.eye(3)]
    assert gradient == pytest.approx(numeric, rel=1e-4, abs=1e-3)
    assert np.array_equal(hessian, hessian.T)
    assert np.linalg.eigvalsh(hessian).min() > 0.0


# ------------------------------------------------------------------------ Gaussian of a past moment


DENSITY = np.diag([0.03, 0.05]) ** 2 * 0.1
TWISTS = [np.array(twist) for twist in ([0.8, 0.4], [0.9, -1.0], [0.2, 0.7])]
BEFORE = Gaussian(np.array([1.0, 2.0, 3.0]), np.diag([0.1, 0.1, 0.05]) ** 2)
MEASURED = np.array([0.87, 2.05, 3.05]), np.diag([0.02, 0.03, 0.01]) ** 2


def test_a_late_measurement_counts_as_if_it_had_come_in_time():
    delayed, timely = DelayedPose(BEFORE, kept=1.0), BEFORE
    for k, twist in enumerate(TWISTS):
        delayed.move(Motion(0.1 * k, 0.1 * (k + 1), twist, DENSITY))
    assert delayed.go_to(0.14)
    delayed.past = pose_given(delayed.past, *MEASURED)
    for begin, end, twist in ((0.0, 0.1, 0), (0.1, 0.14, 1), (0.14, 0.2, 1), (0.2, 0.3, 2)):
        timely = pose_moved(timely, TWISTS[twist], DENSITY / (end - begin), end - begin)
        if end == 0.14:
            timely = pose_given(timely, *MEASURED)
    assert delayed.now.mean == pytest.approx(timely.mean, abs=1e-9)
    assert delayed.now.covariance == pytest.approx(timely.covariance, abs=1e-9)


# --------------------------------------------------------------------------------------- localizer


NOISE = dict(profile("pearson"))
START = np.array([2.9, 1.2, 0.0])


@pytest.fixture(scope="module")
def search(room):
    field = LikelihoodField.of(room, Sensors().scanner, NOISE["lidar.range"])
    return FloorSearch.of(field, room, 0.22, START[None, :2])


@pytest.fixture(scope="module")
def localizer(search):
    """localizer() -> a filter that starts at START, or elsewhere."""
    twists = TwistSensors.of(NOISE, RobotLimits())
    return lambda start=START: ScanMatchingLocalizer(search, twists, start, 50, 0)


@pytest.fixture(scope="module")
def circle(room, ranges):
    """circle(ticks, seed) -> readings and true poses of a robot that drives in a circle."""

    def drive(ticks, seed, noise=NOISE, start=START):
        rng, pose, readings, truth = np.random.default_rng(seed), np.array(start), [], []
        for k in range(ticks):
            if k:
                pose = integrate(pose, 0.5, 0.9, 0.1)
            drawn = {channel: noise[channel].sample(rng, 1)[0] for channel in ("odometry.v", "odometry.omega", "gyro")}
            exact = ranges(room, pose)
            readings.append(
                Reading(
                    time=0.1 * k,
                    interval=0.1 if k else 0.0,
                    odometry=np.array([0.5 + drawn["odometry.v"], 0.9 + drawn["odometry.omega"]]),
                    gyro=0.9 + drawn["gyro"],
                    pose=np.full(3, np.nan),
                    detections=np.zeros((0, 2)),
                    scan=np.maximum(exact + noise["lidar.range"].sample(rng, len(exact)), 0.0),
                )
            )
            truth.append(pose)
        return readings, np.array(truth)

    return drive


def test_the_pose_is_found_and_its_covariance_covers_the_error(localizer, circle):
    readings, truth = circle(150, 1)
    found, nees, errors = localizer(), [], []
    for reading, pose in zip(readings, truth, strict=True):
        belief = found.update(reading)
        errors.append(error_of(belief.mean, pose))
        nees.append(errors[-1] @ np.linalg.solve(belief.covariance, errors[-1]))
        assert not belief.recovered
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 5e-3
    assert 0.7 < np.mean(nees) < 3.5
    assert np.mean(np.array(nees) < chi2.ppf(0.95, 3)) > 0.9
    assert belief.particles.shape == (50, 3)


def test_a_robot_that_was_carried_away_is_found_again(localizer, circle):
    here, _ = circle(20, 3)
    there, truth = circle(40, 4, start=(5.3, 2.8, 2.0))
    found = localizer()
    for reading in here:
        found.update(reading)
    after = [found.update(replace(reading, time=2.0 + reading.time, interval=0.1)) for reading in there]
    assert any(belief.recovered for belief in after[:20])
    assert np.abs(error_of(after[-1].mean, truth[-1])).max() < 0.02
