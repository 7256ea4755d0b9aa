from dataclasses import replace

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from mjnav.estimation.person_motion import StopAndGo
from mjnav.estimation.tracker import ParticleTracker
from mjnav.estimation.walk_filter import RaoBlackwellTracker, WalkFilter, detection_noise
from mjnav.filters.mixture_kalman import GaussianSum
from mjnav.messages import Reading
from mjnav.noise import profile
from mjnav.rng import stream

PERIOD = 0.1
GAUSSIAN = GaussianSum(np.ones(1), np.zeros((1, 2)), np.array([0.04**2 * np.eye(2)]))


def test_without_turns_and_stops_it_is_filterpys_kalman_filter():
    motion = StopAndGo(turn_rate=0.0, stop_rate=0.0, walking=1.0, sway=0.3, shuffle=0.1)
    walk = WalkFilter(50, np.random.default_rng(0), motion)
    rng, F = np.random.default_rng(1), np.eye(4)
    F[:2, 2:] = PERIOD * np.eye(2)
    gain = np.vstack([0.5 * PERIOD * np.eye(2), np.eye(2)])
    kalman = KalmanFilter(dim_x=4, dim_z=2)
    kalman.H, kalman.R = np.eye(2, 4), 0.04**2 * np.eye(2)
    for k in range(30):
        z = np.array([k * PERIOD, 0.5]) + 0.04 * rng.standard_normal(2)
        if k:
            walk.predict(PERIOD)
            walk.correct(z, GAUSSIAN)
            Q = 0.3**2 * PERIOD * gain @ gain.T
            Q[:2, :2] += 0.1**2 * PERIOD * np.eye(2)
            kalman.predict(F=F, Q=Q)
            kalman.update(z)
        else:
            walk.start(z, GAUSSIAN)
            kalman.x, kalman.P = np.append(z, [0.0, 0.0]), np.diag([0.04**2, 0.04**2, 1.0, 1.0])
    assert walk.mean == pytest.approx(kalman.x)
    assert walk.covariance == pytest.approx(kalman.P)


def test_an_old_measurement_counts_for_the_time_at_which_it_was_made():
    # A straight walk: what sways meanwhile would be no part of an old measurement.
    motion = StopAndGo(turn_rate=0.0, stop_rate=0.0, sway=0.0, shuffle=0.0, walking=1.0)
    late, prompt = (WalkFilter(50, np.random.default_rng(0), motion) for _ in range(2))
    for walk in (late, prompt):
        walk.start(np.zeros(2), GAUSSIAN)
    late.predict(0.2)
    late.correct(np.array([0.1, 0.0]), GAUSSIAN, age=0.1)
    prompt.predict(0.1)
    prompt.correct(np.array([0.1, 0.0]), GAUSSIAN)
    prompt.predict(0.1)
    assert late.mean == pytest.approx(prompt.mean)
    assert late.covariance == pytest.approx(prompt.covariance)


def test_what_is_weighed_down_loses_weight_and_the_mean_factor_comes_back():
    walk = WalkFilter(50, np.random.default_rng(0))
    walk.start(np.zeros(2), GAUSSIAN)  # half of it walks, half of it stands
    owner, points = walk.heaviest(1)
    assert points.shape == (2, 1, 2)
    assert walk.reweigh(owner, np.array([0.0])) == 0.0  # of all that is looked at: nothing changes
    assert walk.covariance[2, 2] == pytest.approx(0.5, abs=0.01)
    assert walk.reweigh(np.array([0, 1]), np.array([0.0, 0.5])) == pytest.approx(0.25)
    assert walk.covariance[2, 2] == pytest.approx(StopAndGo().unrest ** 2)


def means(make, path, seeds):
    """Mean states (S, T, 4) of trackers along a path (T, 2) under the default noise."""
    noise = dict(profile("pearson"))
    found = []
    for seed in seeds:
        tracker = make(noise, 200, [0.3], seed)
        error = np.stack([noise[f"detection.{c}"].sample(stream(seed, f"detection.{c}"), len(path)) for c in "xy"], 1)
        readings = [
            Reading(PERIOD * k, PERIOD * bool(k), np.zeros(2), 0.0, np.zeros(3), z[None], np.zeros(0))
            for k, z in enumerate(path + error)
        ]
        found.append([tracker.update(reading)[0].mean for reading in readings])
    return np.array(found)


def test_velocities_tremble_half_as_much_as_the_bootstrap_filters_and_follow_a_stop_and_a_turn_no_later():
    time = PERIOD * np.arange(70)
    stops = np.stack([1.2 * np.minimum(time, 5.0), 0.0 * time], axis=1)
    turns = np.stack([1.2 * np.minimum(time, 5.0), 1.2 * np.maximum(time - 5.0, 0.0)], axis=1)
    tremble, stopped, turned = [], [], []
    for make in (ParticleTracker, RaoBlackwellTracker):
        stop, turn = (means(make, path, range(4)) for path in (stops, turns))
        tremble.append(np.diff(np.concatenate([stop, turn])[:, 15:50, 2:], axis=1).std())
        stopped.append(PERIOD * np.argmax(stop[:, 50:, 2].mean(axis=0) < 0.3))
        turned.append(PERIOD * np.argmax(turn[:, 50:, 3].mean(axis=0) > 0.9))
    assert tremble[1] < 0.6 * tremble[0]
    assert stopped[1] <= stopped[0] + 0.15
    assert turned[1] <= turned[0] + 0.05
    assert max(stopped[1], turned[1]) <= 0.6


def test_the_noise_of_detections_keeps_its_skew():
    noise = dict(profile("pearson"))
    found = detection_noise(noise)
    assert np.diagonal(found.variance) == pytest.approx(2 * [0.12**2], rel=0.05)
    # The third central moment of a sum of Gaussians; 1.2 is the noise's skew.
    m, C, w = found.means[:, 0], found.covariances[:, 0, 0], found.weights
    assert w @ (m**3 + 3.0 * m * C) / 0.12**3 == pytest.approx(1.2, abs=0.25)


def test_who_is_not_reported_goes_on_and_is_not_looked_for_anew():
    path = np.stack([0.8 * PERIOD * np.arange(40), np.zeros(40)], axis=1)
    tracker = RaoBlackwellTracker(dict(profile("gaussian")), 100, [0.3], 0)
    for k, z in enumerate(path):
        lost = 20 <= k < 30
        z = np.full(2, np.nan) if lost else z
        reading = Reading(PERIOD * k, PERIOD * bool(k), np.zeros(2), 0.0, np.zeros(3), z[None], np.zeros(0))
        (track,) = tracker.update(replace(reading, dropped=("detections",) if lost else ()))
        if k == 29:
            assert track.mean[0] == pytest.approx(path[k, 0], abs=0.4)
    assert track.mean[:2] == pytest.approx(path[-1], abs=0.1)


def test_a_person_carried_away_is_found_again():
    path = np.zeros((40, 2))
    path[20:] = [4.0, -3.0]
    found = means(RaoBlackwellTracker, path, [0])[0]
    assert found[21, :2] == pytest.approx([0.0, 0.0], abs=0.2)
    assert found[-1, :2] == pytest.approx([4.0, -3.0], abs=0.2)
