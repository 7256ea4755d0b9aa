import numpy as np
import pytest

from mjnav.estimation.base import FilterSettings
from mjnav.estimation.kalman import ExtendedKalmanLocalizer, KalmanTracker, UnscentedKalmanLocalizer
from mjnav.estimation.localizer import ParticleLocalizer
from mjnav.estimation.person_motion import PersonMotion
from mjnav.estimation.tracker import ParticleTracker
from mjnav.geometry.angles import wrap
from mjnav.noise import make_distribution, profile

LOCALIZERS = (ExtendedKalmanLocalizer, UnscentedKalmanLocalizer)


@pytest.mark.parametrize("kind", LOCALIZERS)
def test_kalman_and_particle_filter_agree_where_the_noise_is_gaussian(drive, gaussian, kind):
    readings, _ = drive(gaussian, 0, ticks=40, start=(0.0, 0.0, 3.0))
    kalman = kind(gaussian, 100, 0)
    particle = ParticleLocalizer(gaussian, 20_000, 0, FilterSettings(epsilon=1e-9, roughening=0.05))
    for reading in readings:
        expected, belief = kalman.update(reading), particle.update(reading)
        std = np.sqrt(np.diagonal(expected.covariance))
        difference = belief.mean - expected.mean
        difference[2] = wrap(difference[2])
        assert np.all(np.abs(difference) < 0.15 * std)
        scale = np.outer(std, std)
        assert belief.covariance / scale == pytest.approx(expected.covariance / scale, abs=0.15)


@pytest.mark.parametrize("kind", LOCALIZERS)
def test_the_kalman_localizers_are_consistent_and_cross_pi(drive, gaussian, kind):
    nees = []
    for seed in range(3):
        kalman = kind(gaussian, 50, seed)
        readings, truth = drive(gaussian, seed, ticks=150, omega=0.6)
        assert np.abs(np.diff(truth[:, 2])).max() > 6.0
        for reading, pose in zip(readings, truth, strict=True):
            belief = kalman.update(reading)
            error = belief.mean - pose
            error[2] = wrap(error[2])
            nees.append(error @ np.linalg.solve(belief.covariance, error))
            assert abs(belief.mean[2]) <= np.pi
    assert 2.0 < np.mean(nees) < 4.2


def test_the_mean_of_a_noise_is_taken_off(drive, gaussian):
    noise = gaussian | {
        "pose.x": make_distribution("gaussian", mean=0.5, std=0.08),
        "odometry.v": make_distribution("gaussian", mean=-0.4, std=0.03),
        "detection.y": make_distribution("gaussian", mean=-0.7, std=0.12),
    }
    readings, truth = drive(noise, 1, ticks=60, people=[(1.0, 2.0, 0.0, 0.0)])
    filters = [kind(noise, 10, 1) for kind in LOCALIZERS]
    tracker = KalmanTracker(noise, 10, [0.3], 1)
    for reading in readings:
        beliefs = [f.update(reading) for f in filters]
        (track,) = tracker.update(reading)
    for belief in beliefs:
        assert belief.mean[:2] == pytest.approx(truth[-1, :2], abs=0.08)
    assert track.mean[:2] == pytest.approx([1.0, 2.0], abs=0.2)


def test_kalman_and_particle_tracker_agree_where_motion_and_noise_are_gaussian(drive, gaussian):
    motion = PersonMotion(sway=0.7, turn_rate=0.0)
    kalman = KalmanTracker(gaussian, 10, [0.3] * 2, 0, motion=motion)
    particle = ParticleTracker(gaussian, 20_000, [0.3] * 2, 0, FilterSettings(epsilon=1e-9, roughening=0.0), motion)
    readings, _ = drive(gaussian, 0, ticks=15, people=[(1.0, 2.0, 1.0, 0.0), (0.0, 0.0, 0.0, -1.0)])
    for reading in readings:
        for expected, track in zip(kalman.update(reading), particle.update(reading), strict=True):
            std = np.sqrt(np.diagonal(expected.covariance))
            assert np.all(np.abs(track.mean - expected.mean) < 0.1 * std)
            scale = np.outer(std, std)
            assert track.covariance / scale == pytest.approx(expected.covariance / scale, abs=0.1)


@pytest.mark.parametrize("kind", LOCALIZERS)
def test_particles_are_draws_from_the_gaussian(drive, pearson, kind):
    readings, _ = drive(pearson, 3, ticks=10)
    kalman = kind(pearson, 20_000, 3)
    for reading in readings:
        belief = kalman.update(reading)
    std = np.sqrt(np.diagonal(belief.covariance))
    assert np.all(np.abs(belief.particles.mean(axis=0) - belief.mean) < 0.03 * std)
    assert np.cov(belief.particles.T) == pytest.approx(belief.covariance, abs=0.03 * std.max() ** 2)
    assert kalman.draw(25).shape == (25, 3)


@pytest.mark.parametrize("kind", LOCALIZERS)
def test_readings_without_noise_are_followed_without_a_nan(drive, kind):
    noise = dict(profile("none"))
    readings, truth = drive(noise, 4, ticks=50, people=[(1.0, 2.0, 1.0, 0.0)])
    kalman, tracker = kind(noise, 20, 4), KalmanTracker(noise, 20, [0.3], 4)
    for reading, pose in zip(readings, truth, strict=True):
        belief, (track,) = kalman.update(reading), tracker.update(reading)
        assert belief.mean == pytest.approx(pose, abs=1e-6)
        assert np.isfinite(belief.particles).all()
        assert np.isfinite(track.particles).all()
