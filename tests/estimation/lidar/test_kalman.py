from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from mjnav.estimation.lidar.kalman import ExtendedScanLocalizer, UnscentedScanLocalizer
from mjnav.estimation.lidar.likelihood_field import LikelihoodField
from mjnav.estimation.lidar.recovery import FloorSearch
from mjnav.estimation.lidar.scan import TwistSensors
from mjnav.geometry.angles import wrap
from mjnav.messages import Reading, RobotLimits
from mjnav.motion.unicycle import integrate
from mjnav.noise import profile
from mjnav.scenarios.sensors import Sensors

NOISE = dict(profile("pearson"))
START = np.array([2.9, 1.2, 0.0])
KINDS = (ExtendedScanLocalizer, UnscentedScanLocalizer)


@pytest.fixture(scope="module")
def search(room):
    field = LikelihoodField.of(room, Sensors().scanner, NOISE["lidar.range"])
    return FloorSearch.of(field, room, 0.22, START[None, :2])


@pytest.fixture(scope="module")
def localizer(search):
    """localizer(kind) -> a filter that starts at START, or elsewhere."""
    twists = TwistSensors.of(NOISE, RobotLimits())
    return lambda kind, start=START: kind(search.field, search, twists, start, 50, 0)


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


def error_of(belief, pose):
    error = belief.mean - pose
    error[2] = wrap(error[2])
    return error


@pytest.mark.parametrize("kind", KINDS)
def test_the_pose_is_found_and_its_covariance_covers_the_error(localizer, circle, kind):
    readings, truth = circle(150, 1)
    found, nees, errors = localizer(kind), [], []
    for reading, pose in zip(readings, truth, strict=True):
        belief = found.update(reading)
        errors.append(error_of(belief, pose))
        nees.append(errors[-1] @ np.linalg.solve(belief.covariance, errors[-1]))
        assert not belief.recovered
    assert np.sqrt(np.mean(np.square(errors), axis=0)).max() < 5e-3
    assert 0.7 < np.mean(nees) < 3.5
    assert np.mean(np.array(nees) < chi2.ppf(0.95, 3)) > 0.9
    assert belief.particles.shape == (50, 3)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_missing_makes_the_belief_wider_and_never_nan(localizer, circle, kind):
    readings, truth = circle(90, 2)
    found, spreads = localizer(kind), []
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
        error = error_of(belief, pose)
        assert error @ np.linalg.solve(belief.covariance, error) < 30.0
        spreads.append(float(np.sqrt(np.trace(belief.covariance[:2, :2]))))
    assert 2.0 * spreads[19] < spreads[29] < spreads[39] < spreads[59]
    assert spreads[59] > 0.3
    assert max(spreads[65:]) < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_a_robot_that_was_carried_away_is_found_again(localizer, circle, kind):
    here, _ = circle(20, 3)
    there, truth = circle(40, 4, start=(5.3, 2.8, 2.0))
    found = localizer(kind)
    for reading in here:
        found.update(reading)
    after = [found.update(replace(reading, time=2.0 + reading.time, interval=0.1)) for reading in there]
    assert any(belief.recovered for belief in after[:20])
    assert np.abs(error_of(after[-1], truth[-1])).max() < 0.02


def test_wheels_that_slip_do_not_lead_it_away(localizer, circle):
    readings, truth = circle(60, 7)
    found, far = localizer(ExtendedScanLocalizer), []
    for k, (reading, pose) in enumerate(zip(readings, truth, strict=True)):
        turned = reading.odometry * (3.0 if k >= 20 else 1.0)  # the wheels turn three times as fast as the robot moves
        far.append(np.hypot(*error_of(found.update(replace(reading, odometry=turned)), pose)[:2]))
    assert max(far) < 0.35
    assert np.mean(far[20:]) < 0.2


def test_without_a_start_the_first_scan_says_where_the_robot_is(localizer, circle):
    readings, truth = circle(10, 5)
    found = localizer(ExtendedScanLocalizer, start=None)
    belief = found.update(replace(readings[0], scan=np.zeros(0), dropped=("scan",)))
    assert np.isfinite(belief.particles).all()
    assert belief.covariance[0, 0] > 1.0
    for reading, pose in zip(readings[1:], truth[1:], strict=True):
        belief = found.update(reading)
        assert np.abs(error_of(belief, pose)).max() < 0.02


def test_a_scan_that_comes_twice_counts_once(localizer, circle):
    readings, _ = circle(5, 6)
    once, twice = (localizer(ExtendedScanLocalizer) for _ in range(2))
    for reading in readings:
        expected = once.update(reading)
        twice.update(reading)
        belief = twice.update(replace(reading, interval=0.0))
        assert np.array_equal(belief.covariance, expected.covariance)
        assert np.array_equal(belief.mean, expected.mean)
