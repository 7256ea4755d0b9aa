"""The filter of a person by histories of walks, turns and stops."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from mjnav.filters.mixture_kalman import GaussianSum, moments
from mjnav.robot.estimation.walk_filter import StopAndGo, WalkFilter, gone_on

MOTION = StopAndGo(walking_speed=1.0, sway=0.5, turn_rate=1.0, stop_rate=0.6, start_rate=0.8, unrest=0.1, shuffle=0.2)
T = 0.4  # [s]


def particle(walks):
    covariance = np.array([[[0.3, 0.1, 0.1, 0.0], [0.1, 0.2, 0.0, 0.05], [0.1, 0.0, 0.4, 0.1], [0.0, 0.05, 0.1, 0.3]]])
    return np.ones(1), np.array([walks]), np.array([[1.0, 2.0, 0.7, -0.4]]), covariance


@pytest.mark.parametrize("walks", [True, False])
def test_the_ways_of_going_on_have_the_moments_of_states_that_are_moved_one_by_particle(walks):
    weights, mode, mean, covariance = particle(walks)
    w, modes, m, P = gone_on(weights, mode, mean, covariance, T, MOTION)
    rng, num = np.random.default_rng(0), 400_000
    x = rng.multivariate_normal(mean[0], covariance[0], num)
    event = rng.random(num)
    if walks:
        ends = 1.0 - np.exp(-1.6 * T)
        stands, anew = event < ends * 0.6 / 1.6, (event >= ends * 0.6 / 1.6) & (event < ends)
    else:
        starts = 1.0 - np.exp(-0.8 * T)
        stands, anew = event >= starts, event < starts
    z = rng.standard_normal((num, 2))
    v = np.where(stands[:, None], 0.1 * z, np.where(anew[:, None], z, x[:, 2:] + 0.5 * np.sqrt(T) * z))
    x[:, :2] += 0.5 * T * (x[:, 2:] + v) + 0.2 * np.sqrt(T) * rng.standard_normal((num, 2))
    x[:, 2:] = v
    assert w.sum() == pytest.approx(1.0)
    assert w[~modes].sum() == pytest.approx(stands.mean(), abs=0.005)
    mean, covariance = moments(w, m, P)
    assert mean == pytest.approx(x.mean(axis=0), abs=0.01)
    assert covariance == pytest.approx(np.cov(x.T), abs=0.01)


def test_the_variances_are_those_of_the_ways_of_going_on_in_the_long_run():
    motion = StopAndGo(turn_rate=0.4, stop_rate=0.2, start_rate=0.6, unrest=0.0, shuffle=0.1)
    changes = []  # mean square of a component's change, of who walks and who stands
    for walks in (True, False):
        before = motion.walking_speed**2 if walks else 0.0  # of the velocity, of which nothing is known
        covariance = np.diag([0.0, 0.0, before, before])[None]
        w, _, m, P = gone_on(np.ones(1), np.array([walks]), np.zeros((1, 4)), covariance, T, motion)
        goes_on = np.arange(len(w)) < walks  # listed first: the old velocity is a part of the new one
        square = np.where(goes_on, P[:, 2, 2] - before, P[:, 2, 2] + before) + m[:, 2] ** 2
        changes.append(float(w @ square))
    walking = motion.start_rate / (motion.start_rate + motion.stop_rate)
    velocity, position = motion.variances(T)
    assert velocity == pytest.approx(walking * changes[0] + (1.0 - walking) * changes[1])
    assert position == pytest.approx(0.1**2 * T)


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


def test_a_person_who_was_not_detected_is_where_they_would_have_been_missed():
    walk = WalkFilter(50, np.random.default_rng(0), StopAndGo(walking=0.25))
    walk.start(np.zeros(2), GAUSSIAN)  # two particles: it stands, or walks
    assert walk.missed(lambda points: np.ones(len(points))) == 1.0  # of all that is looked at: nothing changes
    assert walk.covariance[2, 2] == pytest.approx(0.25, abs=0.01)
    # The heaviest first, one std to one side and then to the other: 0 of who stands, 1/2 of who walks.
    assert walk.missed(lambda points: np.array([0.0, 1.0, 0.0, 0.0])) == pytest.approx(0.25 * 0.5)
    assert walk.covariance[2, 2] == pytest.approx(0.125 / 0.875, abs=0.01)
