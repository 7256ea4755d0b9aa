"""Localisation by scans of a simulated room: known and global start, a robot carried away, scans that do not come."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

import mjnav
from mjnav.geometry.angles import wrap
from mjnav.robot.estimation import make_localizer
from mjnav.robot.estimation.lidar.localizer import EPSILON, kld_bound

ROOM = {"physics.engine": "kinematic", "stop_on_collision": False, "time_limit": 6.0}
LIDAR = {**ROOM, "estimation.robot.source": "lidar"}
SETTLED = 10  # readings


def driven(start=(0.0, 0.0, 0.0), seed=0, **more):
    """Readings of a drive through hall that goes by the pose sensor, and the true pose at each."""
    drive = {**ROOM, "control.method": "rkhs", "robot.start": list(start)}
    scenario = mjnav.load_scenario("hall", {**drive, **more}, seed=seed)
    readings, truth = [], []
    with mjnav.Simulation(scenario, log=False, scan=True) as simulation:
        while not simulation.done:
            for reading in simulation.readings:
                readings.append(reading)
                truth.append(simulation.truth.robot_pose.copy())
            simulation.step(simulation.decide())
    return readings, np.array(truth)


@pytest.fixture(scope="module")
def drive():
    return driven()


@pytest.fixture(scope="module")
def elsewhere():
    return driven(start=(9.0, -1.9, 2.5))


def localizer(seed=0, **more):
    return make_localizer(mjnav.load_scenario("hall", {**LIDAR, **more}, seed=seed), seed)


def followed(estimator, readings, truth):
    beliefs = [estimator.update(reading) for reading in readings]
    errors = np.array([belief.mean for belief in beliefs]) - truth
    errors[:, 2] = wrap(errors[:, 2])
    return beliefs, errors


def inside(belief, error, squared=5.991):
    """Whether the truth lies in an ellipse of the position, by default that of 95 %."""
    return error[:2] @ np.linalg.solve(belief.covariance[:2, :2], error[:2]) < squared


@pytest.mark.parametrize("lidar", ["ideal", "lds-01"])
def test_the_pose_is_known_to_centimetres_and_the_ellipses_say_so(lidar):
    found, beliefs = [], []
    for seed in range(2):
        readings, truth = driven(seed=seed, **{"sensors.lidar.model": lidar})
        own, errors = followed(localizer(seed, **{"sensors.lidar.model": lidar}), readings, truth)
        found.append(errors)
        beliefs += own
    errors = np.concatenate(found)
    assert np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean()) < 0.03
    assert 0.85 < np.mean([inside(b, e) for b, e in zip(beliefs, errors, strict=True)]) <= 1.0


def test_a_robot_carried_away_is_found_and_says_so(drive, elsewhere):
    estimator = localizer()
    before, _ = followed(estimator, *drive)
    assert not any(belief.recovered for belief in before)
    beliefs, errors = followed(estimator, elsewhere[0][1:], elsewhere[1][1:])
    assert 1 <= sum(belief.recovered for belief in beliefs) <= 3  # places that look alike are tried in turn
    assert np.hypot(*errors[-20:, :2].T).max() < 0.1
    assert np.abs(errors[-20:, 2]).max() < 0.05


@pytest.mark.parametrize("kind", ["particle", "ekf"])
def test_a_start_anywhere_on_the_floor_finds_the_robot(elsewhere, kind):
    keys = {"estimation.robot.start": "global", "estimation.robot.filter": kind}
    beliefs, errors = followed(localizer(**keys), *elsewhere)
    assert np.hypot(*errors[-20:, :2].T).max() < 0.1
    assert len(beliefs[-1].particles) <= 500


def test_without_scans_the_belief_grows_and_stays_honest_and_scans_bring_it_back(drive):
    readings, truth = drive
    blind = [replace(r, scan=np.zeros(0)) if 10 <= k < 40 else r for k, r in enumerate(readings)]
    beliefs, errors = followed(localizer(), blind, truth)
    spread = [np.sqrt(np.trace(belief.covariance[:2, :2])) for belief in beliefs]
    assert spread[39] > 2.0 * spread[9]
    assert all(inside(b, e, 13.8) for b, e in zip(beliefs[10:40], errors[10:40], strict=True))  # 99.9 %
    assert spread[-1] < 0.5 * spread[39]


@pytest.mark.parametrize(
    "fault",
    [
        {"dropped": ("odometry",)},
        {"dropped": ("gyro",), "gyro": np.nan},
        {"odometry": np.full(2, np.nan), "gyro": np.nan},
        {"scan": np.full(360, np.nan)},
        {"scan": np.full(360, np.inf), "odometry": np.full(2, np.inf)},
    ],
)
def test_whatever_does_not_arrive_the_belief_is_finite_and_about_right(drive, fault):
    readings, truth = drive
    faulty = [replace(r, **fault) if 10 <= k < 30 else r for k, r in enumerate(readings)]
    beliefs, errors = followed(localizer(), faulty, truth)
    for belief in beliefs:
        assert np.isfinite(belief.mean).all()
        assert np.linalg.eigvalsh(belief.covariance).min() > 0.0
    assert np.mean([inside(b, e) for b, e in zip(beliefs, errors, strict=True)]) > 0.8
    assert np.hypot(*errors[-1, :2]) < 0.1


def test_the_number_of_particles_is_foxs_bound_with_the_quantile_of_wilson_and_hilferty():
    for num_bins in (5, 20, 100, 1000):
        exact = chi2.ppf(0.99, num_bins - 1) / (2.0 * EPSILON)
        assert kld_bound(num_bins) == pytest.approx(exact, rel=0.01, abs=1.0)
    # Fox 2003, section 3.2: epsilon 0.05, delta 0.01, by hand for k = 2: 10 (1 - 2/9 + sqrt(2/9) 2.3263)^3 = 65.9.
    assert (kld_bound(1), kld_bound(2)) == (1, 66)
