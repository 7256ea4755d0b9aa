"""Matches of scans with a map, and the Kalman filter that is corrected by them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from mjnav.geometry.angles import wrap
from mjnav.geometry.distance_field import DistanceField
from mjnav.geometry.distances import beam_angles
from mjnav.geometry.floor import Floor
from mjnav.messages import Reading, RobotLimits
from mjnav.motion.unicycle import integrate
from mjnav.noise import make_distribution, profile
from mjnav.robot.estimation.kalman import Gaussian, pose_given, pose_moved
from mjnav.robot.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.robot.estimation.lidar.localizer import FloorSearch
from mjnav.robot.estimation.lidar.scan import TwistSensors
from mjnav.robot.estimation.lidar.scan_matching import (
    SCALE,
    UNKNOWN,
    DelayedPose,
    Motion,
    ScanMatchingLocalizer,
    match_scan,
    normal_equations,
    reach_of,
    weighted_law,
)
from mjnav.scene.sensors import LidarSpec, Sensors, lidar_of

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


def test_people_before_the_walls_do_not_pull(room, field, ranges):
    seen = ranges(room, POSE)
    for first in (20, 110, 250):
        seen[first : first + 40] = np.minimum(seen[first : first + 40], 0.8)
    match = match_scan(field, points_of(seen), np.full(360, STD), POSE + np.array([0.05, 0.05, 0.03]))
    assert np.abs(error_of(match.pose, POSE)).max() < 2e-3
    assert 0.6 < match.explained < 0.72


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


def test_returns_that_came_back_for_their_error_alone_do_not_pull(corridor, ranges):
    # A corridor whose end, 2.95 m ahead, is about as far as the lidar sees.
    end = Floor(corridor.discs, np.vstack([corridor.boxes, [[3.05, 1.0, 0.0, 1.0, 1.0, 0.05]]]))
    field, pose, law = DistanceField.of(end), np.array([0.05, 1.0, 0.0]), profile("gaussian")["lidar.range"]
    lidar, rng, found = lidar_of(LidarSpec(spread=0.06), 360, 3.0), np.random.default_rng(0), {}
    for _ in range(40):
        seen = ranges(end, pose) + 0.06 * rng.standard_normal(360)
        seen[seen > lidar.max_range] = np.inf
        for reach in (np.inf, reach_of(lidar, law)):
            found.setdefault(reach, []).append(
                match_scan(field, points_of(seen), np.full(360, 0.06), pose, reach=reach)
            )
    everything, within = found.values()
    errors = [error_of(match.pose, pose)[0] for match in everything]
    assert np.mean(errors) > 0.01 > 4.0 * np.std(errors) / np.sqrt(40)
    assert np.mean([error_of(match.pose, pose)[0] for match in within]) == pytest.approx(0.0, abs=1e-6)
    assert all(match.covariance[0, 0] > 1.0 for match in within)


def test_without_points_or_map_nothing_is_known(room, field, ranges):
    empty = match_scan(field, np.full((360, 2), np.nan), np.full(360, STD), POSE)
    assert empty.pose == pytest.approx(POSE, abs=1e-12)
    assert (empty.num_points, empty.explained) == (0, 0.0)
    assert np.diagonal(empty.covariance).min() >= UNKNOWN**2


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


def test_the_covariance_covers_the_errors(room, field, ranges):
    rng, nees, errors = np.random.default_rng(0), [], []
    for _ in range(150):
        pose = np.array([*rng.uniform([2.8, 0.5], [3.8, 2.5]), rng.uniform(-3.0, 3.0)])
        seen = ranges(room, pose) + STD * rng.standard_normal(360)
        match = match_scan(
            field, points_of(seen), np.full(360, STD), pose + [0.03, 0.03, 0.02] * rng.standard_normal(3)
        )
        error = error_of(match.pose, pose)
        errors.append(error)
        nees.append(error @ np.linalg.solve(match.covariance, error))
    assert 1.0 < np.mean(nees) < 3.3
    assert np.mean(np.array(nees) < chi2.ppf(0.95, 3)) > 0.93
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 5e-3


@pytest.mark.parametrize("name", ["gaussian", "pearson", "bimodal"])
def test_what_the_weights_make_of_a_law_is_what_weighted_means_of_its_draws_do(name):
    law, m, num = profile(name)["lidar.range"], SCALE**2, 100
    draws = (law.sample(np.random.default_rng(0), 400_000) - law.mean) / law.std
    draws = draws.reshape(-1, num)
    mean = np.zeros(len(draws))
    for _ in range(60):  # each row's robust mean, as Gauss-Newton steps find a match
        w = (m / (m + (draws - mean[:, None]) ** 2)) ** 2
        mean = (w * draws).sum(axis=1) / w.sum(axis=1)
    centre, variance = weighted_law(law, map_std=0.0)
    assert mean.mean() == pytest.approx(centre, abs=0.012)
    assert mean.var() == pytest.approx(variance / w.sum(axis=1).mean(), rel=0.1)


def test_a_symmetric_law_is_centred_at_its_mean_and_one_without_a_spread_is_exact():
    assert weighted_law(make_distribution("gaussian", mean=0.3, std=0.05))[0] == pytest.approx(0.0, abs=1e-9)
    assert weighted_law(profile("none")["lidar.range"]) == (0.0, 1.0)


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


def test_it_does_not_go_back_and_does_not_wait_for_ever():
    pose = DelayedPose(BEFORE, kept=0.25)
    for k, twist in enumerate(TWISTS * 2):
        pose.move(Motion(0.1 * k, 0.1 * (k + 1), twist, DENSITY))
    before = pose.now.mean
    # The past has followed to 0.35 s, 0.25 s behind.
    assert not pose.go_to(0.3)
    assert pose.go_to(0.4)
    assert not pose.go_to(0.4)
    assert pose.now.mean == pytest.approx(before, abs=1e-12)


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


def test_what_is_missing_makes_the_belief_wider_and_never_nan(localizer, circle):
    readings, truth = circle(90, 2)
    found, spreads = localizer(), []
    lacks = {
        20: ("scan",), 30: ("scan", "odometry"), 40: ("scan", "gyro"), 50: ("scan", "odometry", "gyro"), 60: ()
    }  # fmt: skip
    for k, (reading, pose) in enumerate(zip(readings, truth, strict=True)):
        missing = lacks.get(10 * (k // 10), ())
        given = replace(
            reading,
            scan=np.full(360, np.nan) if "scan" in missing else reading.scan,
            odometry=np.full(2, np.nan) if "odometry" in missing else reading.odometry,
            gyro=np.nan if "gyro" in missing else reading.gyro,
            dropped=missing,
        )
        belief = found.update(given)
        assert np.isfinite(belief.particles).all()
        error = error_of(belief.mean, pose)
        assert error @ np.linalg.solve(belief.covariance, error) < 30.0
        spreads.append(float(np.sqrt(np.trace(belief.covariance[:2, :2]))))
    assert 2.0 * spreads[19] < spreads[29] < spreads[39] < spreads[59]
    assert spreads[59] > 0.3
    assert max(spreads[65:]) < 0.01


def test_a_robot_that_was_carried_away_is_found_again(localizer, circle):
    here, _ = circle(20, 3)
    there, truth = circle(40, 4, start=(5.3, 2.8, 2.0))
    found = localizer()
    for reading in here:
        found.update(reading)
    after = [found.update(replace(reading, time=2.0 + reading.time, interval=0.1)) for reading in there]
    assert any(belief.recovered for belief in after[:20])
    assert np.abs(error_of(after[-1].mean, truth[-1])).max() < 0.02


def test_wheels_that_slip_do_not_lead_it_away(localizer, circle):
    readings, truth = circle(60, 7)
    found, far = localizer(), []
    for k, (reading, pose) in enumerate(zip(readings, truth, strict=True)):
        turned = reading.odometry * (3.0 if k >= 20 else 1.0)  # the wheels turn three times as fast as the robot moves
        far.append(np.hypot(*error_of(found.update(replace(reading, odometry=turned)).mean, pose)[:2]))
    assert max(far) < 0.35
    assert np.mean(far[20:]) < 0.2


def test_without_a_start_the_first_scan_says_where_the_robot_is(localizer, circle):
    readings, truth = circle(10, 5)
    found = localizer(start=None)
    belief = found.update(replace(readings[0], scan=np.zeros(0), dropped=("scan",)))
    assert np.isfinite(belief.particles).all()
    assert belief.covariance[0, 0] > 1.0
    for reading, pose in zip(readings[1:], truth[1:], strict=True):
        belief = found.update(reading)
        assert np.abs(error_of(belief.mean, pose)).max() < 0.02


def test_a_scan_that_comes_twice_counts_once(localizer, circle):
    readings, _ = circle(5, 6)
    once, twice = (localizer() for _ in range(2))
    for reading in readings:
        expected = once.update(reading)
        twice.update(reading)
        belief = twice.update(replace(reading, interval=0.0))
        assert np.array_equal(belief.covariance, expected.covariance)
        assert np.array_equal(belief.mean, expected.mean)
