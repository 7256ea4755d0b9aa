import numpy as np
import pytest
from scipy.stats import chi2, kurtosis, multivariate_normal

from mjnav.estimation.imm import ImmPersonFilter
from mjnav.estimation.kalman import ImmTracker, KalmanTracker
from mjnav.estimation.person_filter import KalmanPersonFilter
from mjnav.estimation.person_motion import PersonMotion

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
    motion = PersonMotion()
    imm = ImmPersonFilter(motion)
    imm.start(np.array([1.0, 2.0]), NOISE)
    # s = 1/2: of the people that the chain makes a third stands.
    modes = np.array([1.0, 2.0, 0.0]) / 3.0
    assert imm.mode_probabilities == pytest.approx(modes)
    start = np.array([1.0, 2.0, 0.0, 0.0])
    states = [(start, np.diag([0.0144, 0.0144, std**2, std**2])) for std in (motion.still, 1.0, 1.0)]
    for measured in ([1.1, 2.0], [1.1, 2.3], [1.5, 2.2]):
        modes, states = literal_step(modes, states, np.array(measured), motion)
        imm.predict(INTERVAL)
        imm.correct(np.array(measured), NOISE)
        mean = sum(p * x for p, (x, _) in zip(modes, states, strict=True))
        covariance = sum(p * (P + np.outer(x - mean, x - mean)) for p, (x, P) in zip(modes, states, strict=True))
        assert imm.mode_probabilities == pytest.approx(modes, rel=1e-9)
        assert imm.mean == pytest.approx(mean, rel=1e-9)
        assert imm.covariance == pytest.approx(covariance, rel=1e-7, abs=1e-12)


def test_without_measurements_the_modes_go_to_the_chains_long_run_and_the_speed_to_the_motions():
    imm, motion = ImmPersonFilter(), PersonMotion()
    imm.start(np.zeros(2), NOISE)
    for _ in range(300):
        imm.predict(INTERVAL)
    chain, _, _ = motion.modes(INTERVAL)
    assert imm.mode_probabilities == pytest.approx(np.linalg.matrix_power(chain, 2000)[0], abs=1e-9)
    # Of all cases' velocities after a change and the sway since: neither grows without end.
    assert 0.3 < np.sqrt(imm.covariance[2, 2]) < 1.5
    before = imm.mean, imm.covariance
    imm.predict(0.0)
    assert np.array_equal(imm.mean, before[0])
    assert np.array_equal(imm.covariance, before[1])


def test_of_people_who_never_change_it_is_the_kalman_filter(drive, gaussian):
    motion = PersonMotion(sway=0.7, turn_rate=0.0, stop_share=1e-9)  # nobody stands at the start
    readings, _ = drive(gaussian, 0, ticks=20, people=[(1.0, 2.0, 1.0, 0.0)])
    imm, kalman = (kind(gaussian, 10, [0.3], 0, motion=motion) for kind in (ImmTracker, KalmanTracker))
    for reading in readings:
        (found,), (expected,) = imm.update(reading), kalman.update(reading)
        assert found.mean == pytest.approx(expected.mean, abs=1e-6)
        assert found.covariance == pytest.approx(expected.covariance, abs=1e-6)


def walkers(motion, num, ticks, rng):
    """States (ticks, num, 4) of people who move as `motion` says, and their measured positions."""
    state = np.hstack([np.zeros((num, 2)), rng.standard_normal((num, 2))])
    truth = [state]
    for _ in range(ticks - 1):
        state = motion.predict(state, INTERVAL, rng.random(num), rng.standard_normal((num, 2)))
        truth.append(state)
    truth = np.array(truth)
    return truth, truth[..., :2] + 0.12 * rng.standard_normal((ticks, num, 2))


def test_it_is_consistent_and_knows_the_velocity_better_than_one_kalman_filter():
    motion = PersonMotion()
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
    assert np.cov(drawn.T) / np.outer(std, std) == pytest.approx(imm.covariance / np.outer(std, std), abs=0.05)
    # One that stands or walks slowly: a narrow heap in a wide one, where a Gaussian has kurtosis 3.
    assert kurtosis(drawn[:, 3], fisher=False) > 4.0
