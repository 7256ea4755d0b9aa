"""The bootstrap filter of the robot's pose."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.geometry.angles import wrap
from mjnav.noise import make_distribution
from mjnav.noise.correlated import Correlated
from mjnav.robot.estimation.particle import SLIDE, ParticleLocalizer, SkiddingLocalizer

SETTLED = 20  # readings after which the start is forgotten


def track(localizer, readings, truth):
    """Beliefs, and errors (T, 3) of their means."""
    beliefs = [localizer.update(reading) for reading in readings]
    errors = np.array([belief.mean for belief in beliefs]) - truth
    errors[:, 2] = wrap(errors[:, 2])
    return beliefs, errors


def test_errors_fall_well_below_the_sensors_and_the_belief_is_consistent_under_skewed_noise(drive, pearson):
    nees, squares = [], []
    for seed in range(8):
        beliefs, errors = track(ParticleLocalizer(pearson, 500, seed), *drive(pearson, seed, ticks=150))
        nees += [e @ np.linalg.solve(b.covariance, e) for b, e in zip(beliefs, errors, strict=True)][SETTLED:]
        squares.append(errors[SETTLED:] ** 2)
    rmse = np.sqrt(np.mean(np.concatenate(squares), axis=0))
    assert np.all(rmse < [0.35, 0.35, 0.5] * np.array([pearson[f"pose.{c}"].std for c in ("x", "y", "theta")]))
    assert 2.0 < np.mean(nees) < 4.5  # 3 for an exact Gaussian posterior
    assert np.mean(np.array(nees) < 7.815) > 0.88  # the 95 % region of three degrees of freedom


def test_of_a_robot_at_rest_whose_readings_err_alike_the_belief_is_that_of_generalised_least_squares(drive, gaussian):
    """x = 1'R^-1 z / 1'R^-1 1, variance 1 / 1'R^-1 1 (Aitken), R_ij = std^2 exp(-|t_i - t_j| / tau); flat prior."""
    tau, std, num, lost = 1.0, gaussian["pose.x"].std, 45, 3
    law = gaussian | {channel: make_distribution("zero") for channel in ("odometry.v", "odometry.omega", "pose.theta")}
    seen = [k for k in range(num) if k % lost != 1]
    inverse = np.linalg.inv(std**2 * np.exp(-0.1 / tau * np.abs(np.subtract.outer(seen, seen))))
    apart, spread = [], []
    for seed in range(12):
        world = law | {"pose.x": Correlated(law["pose.x"], 0.1, tau)}
        readings, truth = drive(world, seed, num, v=0.0, omega=0.0)
        readings = [r if k in seen else replace(r, dropped=("pose",)) for k, r in enumerate(readings)]
        beliefs, _ = track(ParticleLocalizer(law, 2000, seed, {"pose.x": tau}), readings, truth)
        exact = inverse.sum(axis=0) @ [readings[k].pose[0] for k in seen] / inverse.sum()
        apart.append((beliefs[-1].mean[0] - exact) * np.sqrt(inverse.sum()))
        spread.append(beliefs[-1].covariance[0, 0] * inverse.sum())
    assert np.sqrt(np.mean(np.square(apart))) < 0.25  # of the posterior's std
    assert np.mean(spread) == pytest.approx(1.0, abs=0.25)


def test_where_errors_last_a_belief_that_knows_it_is_consistent_and_one_that_does_not_is_too_sure(drive, pearson):
    lasting = dict.fromkeys(("pose.x", "pose.y", "pose.theta", "odometry.v", "odometry.omega"), 1.0)
    inside = {}
    for known in (lasting, {}):
        nees = []
        for seed in range(8):
            world = pearson | {channel: Correlated(pearson[channel], 0.1, tau) for channel, tau in lasting.items()}
            beliefs, errors = track(ParticleLocalizer(pearson, 500, seed, known), *drive(world, seed, ticks=150))
            nees += [e @ np.linalg.solve(b.covariance, e) for b, e in zip(beliefs, errors, strict=True)][SETTLED:]
        inside[bool(known)] = np.mean(np.array(nees) < 7.815)
    assert inside[True] > 0.88 > 0.5 > inside[False]


def test_only_the_right_sign_of_the_noise_leaves_the_pose_unbiased(drive, mirrored, pearson):
    noise = pearson | {"pose.x": make_distribution("pearson", mean=0.0, std=0.08, skew=1.6, kurtosis=7.0)}
    reflected = noise | {"pose.x": mirrored(noise["pose.x"])}

    def errors_x(believed):
        runs = [track(ParticleLocalizer(believed, 300, s), *drive(noise, s, 120, v=0.0)) for s in range(8)]
        return np.array([errors[SETTLED:, 0].mean() for _, errors in runs])

    right, wrong = errors_x(noise), errors_x(reflected)
    assert abs(right.mean()) < 0.012
    assert abs(wrong.mean()) > 0.025
    assert np.sqrt(np.mean(wrong**2)) > 3.0 * np.sqrt(np.mean(right**2))


def test_a_robot_carried_away_is_found_after_the_patience_and_once(drive, pearson):
    readings, _ = drive(pearson, 2, ticks=60)
    elsewhere, truth = drive(pearson, 3, ticks=60, start=(4.0, -3.0, 2.0))
    localizer = ParticleLocalizer(pearson, 500, 2)
    for reading in readings:
        assert not localizer.update(reading).recovered
    beliefs, errors = track(localizer, elsewhere[1:], truth[1:])
    assert [belief.recovered for belief in beliefs] == [False, False, True] + [False] * 56
    assert np.abs(errors[SETTLED:, :2]).max() < 0.08


def test_drawing_does_not_disturb_the_filter(drive, pearson):
    readings, _ = drive(pearson, 6, ticks=30)
    asked, quiet = ParticleLocalizer(pearson, 200, 6), ParticleLocalizer(pearson, 200, 6)
    for reading in readings:
        belief, expected = asked.update(reading), quiet.update(reading)
        asked.draw(25)
        assert np.array_equal(belief.particles, expected.particles)


def test_a_robot_that_skids_turns_as_its_gyro_says_and_may_slide_across_its_heading(drive, pearson):
    """Wheels that turn 1.5 times as quickly as the robot, and no pose after the start."""
    readings, truth = drive(pearson, 4, ticks=30)
    blind = [
        replace(r, odometry=r.odometry * [1.0, 1.5], dropped=("pose",) if i else ())
        for i, r in enumerate(readings)
    ]  # fmt: skip
    by_gyro, by_wheels = (
        track(kind(pearson, 2000, 4), blind, truth) for kind in (SkiddingLocalizer, ParticleLocalizer)
    )
    assert abs(by_gyro[1][-1, 2]) < 0.2 < abs(by_wheels[1][-1, 2])
    plain, by_wheel, by_turn = (
        track(SkiddingLocalizer(pearson, 50, 4, lasting), blind, truth)[1]
        for lasting in ({}, {"odometry.omega": 1.0}, {"gyro": 1.0})
    )
    assert np.array_equal(plain, by_wheel)
    assert not np.array_equal(plain, by_turn)

    still = replace(readings[0], odometry=np.zeros(2), gyro=0.0)
    moving = replace(readings[1], odometry=np.array([1.0, 0.0]), gyro=2.0, dropped=("pose",), interval=0.1)
    exact = {channel: make_distribution("zero") for channel in pearson}
    localizer = SkiddingLocalizer(exact, 4000, 0)
    localizer.update(still)
    particles = localizer.update(moving).particles - still.pose
    across = particles[:, 1] * np.cos(still.pose[2] + 0.1) - particles[:, 0] * np.sin(still.pose[2] + 0.1)
    assert across.std() == pytest.approx(SLIDE * 1.0 * 2.0 * 0.1, rel=0.1)
