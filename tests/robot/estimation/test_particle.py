"""The bootstrap filters of the robot's pose and of people."""

import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import KalmanFilter
from scipy.linalg import block_diag

from mjnav.geometry.angles import wrap
from mjnav.messages import Reading
from mjnav.noise import make_distribution, profile
from mjnav.robot.estimation.base import FilterSettings
from mjnav.robot.estimation.particle import ParticleLocalizer, ParticleTracker, PersonMotion

SETTLED = 20  # readings after which the start is forgotten
PEOPLE = ((0.0, 0.0, 1.0, 0.0), (3.0, 1.0, 0.0, -1.2), (5.0, 5.0, -0.5, 0.5))

# --------------------------------------------------------------------------------------- localizer


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


# ----------------------------------------------------------------------------------------- tracker


def true_states(ticks, people=PEOPLE):
    """(T, P, 4)"""
    people = np.asarray(people)
    states = np.repeat(people[None], ticks, axis=0)
    states[..., :2] += 0.1 * np.arange(ticks)[:, None, None] * people[:, 2:]
    return states


def test_many_particles_have_the_posterior_of_filterpys_kalman_filter():
    std, walking, sway, dt = 0.12, 1.0, 0.8, 0.1
    motion = PersonMotion(walking_speed=walking, sway=sway, turn_rate=0.0)
    settings = FilterSettings(epsilon=1e-9, roughening=0.0)
    rng = np.random.default_rng(0)
    truth = true_states(12, PEOPLE[:1])[:, :, :2]
    measured = truth + std * rng.standard_normal(truth.shape)
    noise = dict(profile("gaussian"))
    assert noise["detection.x"].std == pytest.approx(std)
    tracker = ParticleTracker(noise, 20_000, [0.3], 0, settings, motion)

    kalman = KalmanFilter(dim_x=4, dim_z=2)  # x, vx, y, vy: filterpy's order
    kalman.F = block_diag(*2 * [[[1.0, dt], [0.0, 1.0]]])
    kalman.H = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0]])
    kalman.R *= std**2
    kalman.Q = block_diag(*2 * [Q_discrete_white_noise(2, dt, var=sway**2 / dt)])  # acceleration, held for dt
    kalman.x = np.array([measured[0, 0, 0], 0.0, measured[0, 0, 1], 0.0])
    kalman.P = np.diag([std**2, walking**2, std**2, walking**2])
    order = [0, 2, 1, 3]
    for k, z in enumerate(measured):
        reading = Reading(dt * k, dt * bool(k), np.zeros(2), 0.0, np.zeros(3), z, np.zeros(0))
        (belief,) = tracker.update(reading)
        if k:
            kalman.predict()
            kalman.update(z[0])
        scale = np.sqrt(np.diagonal(kalman.P)[order])
        assert np.all(np.abs(belief.mean - kalman.x[order]) < 0.06 * scale)
        expected = kalman.P[np.ix_(order, order)] / np.outer(scale, scale)
        assert belief.covariance / np.outer(scale, scale) == pytest.approx(expected, abs=0.06)


def test_a_person_carried_away_is_found_and_the_others_are_not_disturbed(drive, pearson):
    readings, _ = drive(pearson, 0, ticks=60, people=PEOPLE)
    alone = ParticleTracker(pearson, 200, [0.3] * 3, 0)
    undisturbed = [alone.update(reading) for reading in readings]
    for reading in readings[40:]:
        reading.detections[1] += [5.0, -4.0]
    tracker = ParticleTracker(pearson, 200, [0.3] * 3, 0)
    tracks = [tracker.update(reading) for reading in readings]
    assert [k for k, row in enumerate(tracks) if row[1].recovered] == [42]
    assert np.abs(tracks[-1][1].mean[:2] - true_states(60)[-1, 1, :2] - [5.0, -4.0]).max() < 0.2
    for row, expected in zip(tracks, undisturbed, strict=True):
        for p in (0, 2):
            assert np.array_equal(row[p].particles, expected[p].particles)


def test_stops_and_turns_have_their_probabilities_and_the_gaussian_model_their_variance():
    num, rng = 200_000, np.random.default_rng(0)

    def step(motion, velocity):
        state = np.concatenate([np.zeros((num, 2)), velocity], axis=1)[None]
        return motion.predict(state, 0.1, rng.random((1, num)), rng.standard_normal((1, num, 2)))[0]

    motion = PersonMotion(turn_rate=2.0, stop_share=0.25)
    state = step(motion, np.tile([30.0, 0.0], (num, 1)))
    q = 1.0 - np.exp(-0.2)
    stopped = np.all(state[:, 2:] == 0.0, axis=1)
    turned = (state[:, 2] < 15.0) & ~stopped
    assert stopped.mean() == pytest.approx(0.25 * q, abs=0.003)
    assert turned.mean() == pytest.approx(0.75 * q, abs=0.003)
    assert state[turned, 2:].std() == pytest.approx(motion.walking_speed, rel=0.02)
    assert state[stopped, 0] == pytest.approx(1.5)  # half the interval at the old velocity
    usual = PersonMotion()
    velocity = usual.walking_speed * rng.standard_normal((num, 2))
    change = step(usual, velocity)[:, 2:] - velocity
    assert np.cov(change.T) == pytest.approx(usual.variances(0.1)[0] * np.eye(2), rel=0.03, abs=0.01)
