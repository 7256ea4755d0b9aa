"""The Kalman filters of the robot's pose and of a person."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from scipy.stats import multivariate_normal

from mjnav.filters.mixture_kalman import GaussianSum
from mjnav.geometry.angles import wrap
from mjnav.motion.unicycle import integrate
from mjnav.noise import make_distribution
from mjnav.robot.estimation.kalman import KalmanLocalizer, KalmanPersonFilter, odometry_jacobians
from mjnav.robot.estimation.tracker import KalmanTracker
from mjnav.robot.estimation.walk_filter import StopAndGo

NOISE = GaussianSum(np.ones(1), np.zeros((1, 2)), 0.12**2 * np.eye(2)[None])  # [m^2] of a measured position


def test_the_jacobians_are_the_derivatives_of_the_arcs_end():
    at, h = np.array([1.0, 2.0, 0.7, 0.8, 0.6]), 1e-6

    def end(x):
        return integrate(x[:3], x[3], x[4], 0.1)

    numeric = np.array([(end(at + h * axis) - end(at - h * axis)) / (2.0 * h) for axis in np.eye(5)]).T
    assert np.hstack(odometry_jacobians(at[:3], at[3:], 0.1)) == pytest.approx(numeric, abs=1e-4)


def test_the_localizer_is_consistent_and_crosses_pi_and_its_particles_are_draws_from_the_gaussian(drive, gaussian):
    nees = []
    for seed in range(3):
        kalman = KalmanLocalizer(gaussian, 5000, seed)
        readings, truth = drive(gaussian, seed, ticks=150, omega=0.6)
        assert np.abs(np.diff(truth[:, 2])).max() > 6.0
        for reading, pose in zip(readings, truth, strict=True):
            belief = kalman.update(reading)
            error = belief.mean - pose
            error[2] = wrap(error[2])
            nees.append(error @ np.linalg.solve(belief.covariance, error))
            assert abs(belief.mean[2]) <= np.pi
    assert 2.0 < np.mean(nees) < 4.2
    std = np.sqrt(np.diagonal(belief.covariance))
    away = belief.particles - belief.mean
    away[:, 2] = wrap(away[:, 2])
    assert np.all(np.abs(away.mean(axis=0)) < 0.06 * std)
    assert np.cov(away.T) / np.outer(std, std) == pytest.approx(belief.covariance / np.outer(std, std), abs=0.06)


def test_the_mean_of_a_noise_is_taken_off(drive, gaussian):
    noise = gaussian | {
        "pose.x": make_distribution("gaussian", mean=0.5, std=0.08),
        "odometry.v": make_distribution("gaussian", mean=-0.4, std=0.03),
        "detection.y": make_distribution("gaussian", mean=-0.7, std=0.12),
    }
    readings, truth = drive(noise, 1, ticks=60, people=[(1.0, 2.0, 0.0, 0.0)])
    kalman, tracker = KalmanLocalizer(noise, 10, 1), KalmanTracker(noise, 10, [0.3], 1)
    for reading in readings:
        belief, (track,) = kalman.update(reading), tracker.update(reading)
    assert belief.mean[:2] == pytest.approx(truth[-1, :2], abs=0.08)
    assert track.mean[:2] == pytest.approx([1.0, 2.0], abs=0.2)


def test_a_persons_filter_is_filterpys_kalman_filter():
    rng, motion, kalman = np.random.default_rng(0), StopAndGo(), KalmanFilter(dim_x=4, dim_z=2)
    person = KalmanPersonFilter(motion)
    F, G = np.eye(4), np.vstack([0.05 * np.eye(2), np.eye(2)])
    F[:2, 2:] = 0.1 * np.eye(2)
    velocity, position = motion.variances(0.1)
    person.start(np.ones(2), NOISE)
    kalman.x, kalman.P = np.array([1.0, 1.0, 0.0, 0.0]), np.diag([0.12**2, 0.12**2, 1.0, 1.0])
    for k in range(20):
        z, age = rng.standard_normal(2), 0.05 * (k % 3)
        H = np.hstack([np.eye(2), -age * np.eye(2)])
        person.predict(0.1)
        kalman.predict(F=F, Q=velocity * G @ G.T + position * np.diag([1.0, 1.0, 0.0, 0.0]))
        law = multivariate_normal(H @ kalman.x, H @ kalman.P @ H.T + 0.12**2 * np.eye(2))
        assert person.density(z, NOISE, age=age) == pytest.approx(law.pdf(z))
        assert person.correct(z, NOISE, age=age) == pytest.approx(law.pdf(z))
        kalman.update(z, R=0.12**2 * np.eye(2), H=H)
        assert person.mean == pytest.approx(kalman.x)
        assert person.covariance == pytest.approx(kalman.P)


def test_the_probability_of_a_detection_is_that_under_the_gaussian():
    person, rng = KalmanPersonFilter(StopAndGo()), np.random.default_rng(1)
    person.start(np.array([1.0, 0.0]), GaussianSum(np.ones(1), np.zeros((1, 2)), np.diag([0.3, 0.01])[None] ** 2))

    def detectable(points):
        return 1.0 / (1.0 + np.exp(points[:, 0]))

    assert person.missed(detectable) == pytest.approx(detectable(person.draw(40_000, rng)).mean(), abs=5e-3)
