import numpy as np
import pytest
from scipy.stats import chi2, kurtosis, multivariate_normal

from mjnav.estimation.person_filter import ImmPersonFilter, KalmanPersonFilter
from mjnav.estimation.person_motion import STANDS, WALKS, StopAndGo, gone_on

INTERVAL = 0.1  # [s]
NOISE = 0.12**2 * np.eye(2)  # [m^2] of a measured position
SEES = np.eye(2, 4)


def literal_step(modes, states, measured, motion, interval=INTERVAL):
    """One cycle of Blom & Bar-Shalom (1988) in plain sums: probabilities and (mean, covariance) of each mode."""
    chain, transitions, noises = motion.modes(interval)
    num = range(len(modes))
    prior = [sum(chain[i, j] * modes[i] for i in num) for j in num]
    moved, weights = [], []
    for j in num:
        share = [chain[i, j] * modes[i] / prior[j] for i in num]
        mean = sum(share[i] * states[i][0] for i in num)
        spread = [states[i][1] + np.outer(states[i][0] - mean, states[i][0] - mean) for i in num]
        covariance = sum(share[i] * spread[i] for i in num)
        mean, covariance = transitions[j] @ mean, transitions[j] @ covariance @ transitions[j].T + noises[j]
        expected = SEES @ covariance @ SEES.T + NOISE
        weights.append(prior[j] * multivariate_normal.pdf(measured, SEES @ mean, expected))
        information = np.linalg.inv(covariance) + SEES.T @ np.linalg.inv(NOISE) @ SEES
        covariance = np.linalg.inv(information)
        mean = mean + covariance @ SEES.T @ np.linalg.inv(NOISE) @ (measured - SEES @ mean)
        moved.append((mean, covariance))
    return np.array(weights) / sum(weights), moved


def test_modes_and_moments_are_those_of_the_literal_algorithm():
    motion = StopAndGo()
    imm = ImmPersonFilter(motion)
    imm.start(np.array([1.0, 2.0]), NOISE)
    modes = np.array([0.5, 0.5, 0.0])
    assert imm.mode_probabilities == pytest.approx(modes)
    start = np.array([1.0, 2.0, 0.0, 0.0])
    states = [(start, np.diag([0.0144, 0.0144, std**2, std**2])) for std in (motion.unrest, 1.0, 1.0)]
    for measured in ([1.1, 2.0], [1.1, 2.3], [1.5, 2.2]):
        modes, states = literal_step(modes, states, np.array(measured), motion)
        imm.predict(INTERVAL)
        imm.correct(np.array(measured), NOISE)
        mean = sum(p * x for p, (x, _) in zip(modes, states, strict=True))
        covariance = sum(p * (P + np.outer(x - mean, x - mean)) for p, (x, P) in zip(modes, states, strict=True))
        assert imm.mode_probabilities == pytest.approx(modes, rel=1e-9)
        assert imm.mean == pytest.approx(mean, rel=1e-9)
        assert imm.covariance == pytest.approx(covariance, rel=1e-7, abs=1e-12)


def test_without_measurements_the_modes_follow_the_chain_and_the_speed_stays_a_walkers():
    imm, motion = ImmPersonFilter(), StopAndGo()
    imm.start(np.zeros(2), NOISE)
    for _ in range(300):
        imm.predict(INTERVAL)
    chain, _, _ = motion.modes(INTERVAL)
    assert imm.mode_probabilities == pytest.approx(np.array([0.5, 0.5, 0.0]) @ np.linalg.matrix_power(chain, 300))
    # A velocity that is forgotten now and then does not spread without end.
    assert 0.3 < np.sqrt(imm.covariance[2, 2]) < 1.5
    before = imm.mean, imm.covariance
    imm.predict(0.0)
    assert np.array_equal(imm.mean, before[0])
    assert np.array_equal(imm.covariance, before[1])


def test_its_modes_are_the_ways_in_which_the_particles_of_the_same_motion_go_on():
    motion, rng = StopAndGo(), np.random.default_rng(0)
    mean, spread = rng.standard_normal(4), np.cov(rng.standard_normal((4, 9)))
    chain, transitions, noises = motion.modes(INTERVAL)
    for mode, row, ways in ((WALKS, chain[1], [1, 2, 0]), (STANDS, chain[0], [2, 0])):
        weights, _, means, covariances = gone_on(
            np.ones(1), np.array([mode]), mean[None], spread[None], INTERVAL, motion.rates
        )
        assert weights == pytest.approx(row[ways])
        for way, x, P in zip(ways, means, covariances, strict=True):
            F, Q = transitions[way], noises[way]
            assert x == pytest.approx(F @ mean)
            assert pytest.approx(F @ spread @ F.T + Q, abs=1e-12) == P


def test_of_people_who_never_change_it_is_the_kalman_filter():
    motion = StopAndGo(sway=0.7, turn_rate=0.0, stop_rate=0.0, start_rate=0.0, walking=1.0)
    rng, filters = np.random.default_rng(0), (ImmPersonFilter(motion), KalmanPersonFilter(motion))
    for k in range(20):
        measured, age = np.array([1.0 + 0.1 * k, 2.0]) + 0.1 * rng.standard_normal(2), 0.05 * (k % 3)
        for person in filters:
            if k:
                person.predict(INTERVAL)
                person.correct(measured, NOISE, age)
            else:
                person.start(measured, NOISE)
        imm, kalman = filters
        assert imm.mean == pytest.approx(kalman.mean, abs=1e-6)
        assert imm.covariance == pytest.approx(kalman.covariance, abs=1e-6)


def test_a_position_of_before_counts_for_then():
    late = KalmanPersonFilter(StopAndGo())
    late.start(np.zeros(2), NOISE)
    # z = x - age v: of position 0 +- 0.12 and velocity 0 +- 1, 0.5 s before, z has the variance 0.0144 + 0.25.
    late.correct(np.array([1.0, 0.0]), NOISE, 0.5)
    total = 0.0144 + 0.25 + 0.0144
    assert late.mean == pytest.approx([0.0144 / total, 0.0, -0.5 / total, 0.0])


def walkers(motion, num, ticks, rng):
    """States (ticks, num, 4) of people who move as `motion` says, and their measured positions."""
    chain, transitions, noises = motion.modes(INTERVAL)
    state, modes = np.hstack([np.zeros((num, 2)), rng.standard_normal((num, 2))]), np.ones(num, int)
    truth = [state]
    for _ in range(ticks - 1):
        modes = np.array([rng.choice(3, p=chain[mode]) for mode in modes])
        noise = [rng.multivariate_normal(np.zeros(4), noises[mode]) for mode in modes]
        state = np.array([transitions[mode] @ x + w for mode, x, w in zip(modes, state, noise, strict=True)])
        truth.append(state)
    truth = np.array(truth)
    return truth, truth[..., :2] + 0.12 * rng.standard_normal((ticks, num, 2))


def test_it_is_consistent_and_knows_the_velocity_better_than_one_kalman_filter():
    motion = StopAndGo()
    truth, measured = walkers(motion, 8, 100, np.random.default_rng(1))
    squared, inside = {}, 0.0
    for kind in (ImmPersonFilter, KalmanPersonFilter):
        errors, nees = [], []
        for p in range(truth.shape[1]):
            person = kind(motion)
            person.start(measured[0, p], NOISE)
            for k in range(1, len(truth)):
                person.predict(INTERVAL)
                person.correct(measured[k, p], NOISE)
                errors.append(person.mean - truth[k, p])
                nees.append(errors[-1] @ np.linalg.solve(person.covariance, errors[-1]))
        squared[kind] = np.mean(np.square(errors)[:, 2:])
        if kind is ImmPersonFilter:
            inside = np.mean(np.array(nees) < chi2.ppf(0.95, 4))
            assert 3.0 < np.mean(nees) < 5.0
    assert 0.9 < inside < 0.98
    assert squared[ImmPersonFilter] < 0.9 * squared[KalmanPersonFilter]


def test_draws_are_of_the_mixture():
    imm = ImmPersonFilter()
    imm.start(np.zeros(2), NOISE)
    for k in range(1, 30):
        imm.predict(INTERVAL)
        imm.correct(np.array([0.02 * k, 0.0]), NOISE)
    drawn = imm.draw(40_000, np.random.default_rng(0))
    std = np.sqrt(np.diagonal(imm.covariance))
    assert np.all(np.abs(drawn.mean(axis=0) - imm.mean) < 0.03 * std)
    assert np.cov(drawn.T) / np.outer(std, std) == pytest.approx(imm.covariance / np.outer(std, std), abs=0.1)
    # One that stands or walks slowly: a narrow heap in a wide one, where a Gaussian has kurtosis 3.
    assert kurtosis(drawn[:, 3], fisher=False) > 4.0
