import numpy as np
import pytest

from mjnav.estimation.person_motion import PersonMotion

NUM = 200_000


def step(motion, state, interval, seed=0):
    rng = np.random.default_rng(seed)
    return motion.predict(state, interval, rng.random(NUM), rng.standard_normal((NUM, 2)))


def test_without_changes_a_person_walks_straight_on():
    state = PersonMotion().predict(np.array([1.0, 2.0, 0.5, -1.0]), 0.2, 0.999, np.zeros(2))
    assert state == pytest.approx([1.1, 1.8, 0.5, -1.0], abs=1e-15)


def test_stops_and_turns_have_their_probabilities():
    motion = PersonMotion(turn_rate=2.0, stop_share=0.25)
    state = step(motion, np.tile([0.0, 0.0, 30.0, 0.0], (NUM, 1)), 0.1)
    q = 1.0 - np.exp(-0.2)
    stopped = np.all(state[:, 2:] == 0.0, axis=1)
    turned = (state[:, 2] < 15.0) & ~stopped
    assert stopped.mean() == pytest.approx(0.25 * q, abs=0.003)
    assert turned.mean() == pytest.approx(0.75 * q, abs=0.003)
    assert state[turned, 2:].std() == pytest.approx(motion.walking_speed, rel=0.02)
    assert state[stopped, 0] == pytest.approx(1.5)  # half the interval at the old velocity


def test_the_gaussian_model_has_the_variance_of_the_mixture():
    motion = PersonMotion()
    state = np.zeros((NUM, 4))
    state[:, 2:] = motion.walking_speed * np.random.default_rng(1).standard_normal((NUM, 2))
    transition, covariance = motion.gaussian(0.1)
    change = step(motion, state, 0.1) - state @ transition.T
    assert np.cov(change.T) == pytest.approx(covariance, abs=0.03 * covariance.max())
