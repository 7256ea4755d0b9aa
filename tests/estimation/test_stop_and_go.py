import numpy as np
import pytest

from mjnav.estimation.person_motion import StopAndGo, gone_on
from mjnav.filters.mixture_kalman import moments

MOTION = StopAndGo(walking_speed=1.0, sway=0.5, turn_rate=1.0, stop_rate=0.6, start_rate=0.8, unrest=0.1, shuffle=0.2)
T = 0.4


def one(walks):
    covariance = np.array([[[0.3, 0.1, 0.1, 0.0], [0.1, 0.2, 0.0, 0.05], [0.1, 0.0, 0.4, 0.1], [0.0, 0.05, 0.1, 0.3]]])
    return np.ones(1), np.array([walks]), np.array([[1.0, 2.0, 0.7, -0.4]]), covariance


@pytest.mark.parametrize("walks", [True, False])
def test_the_ways_of_going_on_have_the_moments_of_states_that_are_moved_one_by_one(walks):
    weights, mode, mean, covariance = one(walks)
    w, modes, m, P = gone_on(weights, mode, mean, covariance, T, MOTION.rates)
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


def test_a_way_that_never_happens_is_left_out():
    weights, mode, mean, covariance = one(True)
    w, *_ = gone_on(weights, mode, mean, covariance, T, StopAndGo(turn_rate=0.0, stop_rate=0.0).rates)
    assert w.tolist() == [1.0]
    w, modes, *_ = gone_on(weights, mode, mean, covariance, T, StopAndGo(turn_rate=0.0, stop_rate=0.5).rates)
    assert modes.tolist() == [True, False]
