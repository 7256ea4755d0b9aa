"""Noise that is correlated in time: its law, its correlation, and that of a run."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.stats import kstest, norm

import mjnav
from mjnav.noise import Empirical, Gaussian, Mixture, Pearson, StudentT, Uniform, Zero, profile
from mjnav.noise.correlated import Copula, Correlated, DistributionFunction

SKEWED = Pearson(std=0.08, skew=1.2, kurtosis=5.2)
LAWS = [
    Gaussian(mean=0.3, std=2.0),
    SKEWED,
    Uniform(half_width=1.0),
    Mixture(weights=(0.3, 0.7), means=(-1.0, 0.5), stds=(0.2, 0.1)),
    Empirical(samples=(0.0, 0.1, 0.4, 0.45, 2.0)),
    profile("pearson")["odometry.v"],  # infinite at its end, as many are
    profile("measured")["actuation.v"],
    Pearson(std=1.0, skew=0.0, kurtosis=1.5),  # at both
    Pearson(std=0.05, skew=1.2, kurtosis=3.0),
    Mixture(weights=(0.99, 0.01), means=(0.0, 5.0), stds=(0.01, 0.1)),  # outliers, 10 standard deviations away
    StudentT(std=1.0, df=2.5),
]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_the_function_and_its_inverse_are_those_of_the_laws_own_draws(law):
    function, drawn = DistributionFunction.of(law), law.sample(np.random.default_rng(1), 20_000)
    assert kstest(function.below(drawn), "uniform").pvalue > 1e-3
    shares = np.linspace(0.01, 0.99, 50)
    assert function.below(function.quantile(shares)) == pytest.approx(shares, abs=1e-9)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_draws_far_apart_have_the_law(law):
    """Each 40th of draws with tau = 5 periods: rho^40 = 3e-4."""
    drawn = Correlated(law, 0.1, 0.5).sample(np.random.default_rng(2), 40 * 3000)[::40]
    assert kstest(DistributionFunction.of(law).below(drawn), "uniform").pvalue > 1e-3


def test_of_a_gaussian_the_correlation_is_exp_minus_t_over_tau():
    drawn = Correlated(Gaussian(std=3.0), 0.1, 0.5).sample(np.random.default_rng(3), 200_000)
    for n in (1, 3, 10):
        assert np.corrcoef(drawn[n:], drawn[:-n])[0, 1] == pytest.approx(np.exp(-0.2 * n), abs=0.02)


def test_block_by_block_they_go_on():
    whole = Correlated(SKEWED, 0.1, 1.0).sample(np.random.default_rng(4), 128)
    one, rng = Correlated(SKEWED, 0.1, 1.0), np.random.default_rng(4)
    assert np.array_equal(np.concatenate([one.sample(rng, 64), one.sample(rng, 64)]), whole)


def test_news_of_a_gaussian_is_the_ratio_of_its_transition_to_its_own_density():
    law, (x, before) = Gaussian(std=2.0), np.random.default_rng(5).normal(0.0, 2.0, (2, 50))
    copula = Copula.of(law, 0.5)
    for interval in (0.1, 0.3):
        r = np.exp(-interval / 0.5)
        expected = norm.pdf(x, r * before, 2.0 * np.sqrt(1.0 - r * r)) / norm.pdf(x, 0.0, 2.0)
        assert copula.news(x, before, interval) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("law", LAWS[:4], ids=lambda law: type(law).__name__)
def test_news_makes_of_any_law_the_density_of_the_next_draw(law):
    """Against the shares of draws that follow one whose score is 1, in ten cells."""
    copula, normal = Copula.of(law, 0.3), np.random.default_rng(6).standard_normal(40_000)
    (before,) = copula.values(np.array([1.0]))
    drawn = copula.values(copula.following(np.full(40_000, 1.0), 0.1, normal))
    edges = np.quantile(drawn, np.linspace(0.05, 0.95, 10))
    for low, high in pairwise(edges):
        x = np.linspace(low, high, 400)
        density = np.exp(law.logpdf(x)) * copula.news(x, np.full(400, before), 0.1)
        assert trapezoid(density, x) == pytest.approx(0.1, abs=0.012)


def test_no_noise_stays_none():
    assert Correlated(Zero(), 0.1, 1.0).sample(np.random.default_rng(5), 9).tolist() == [0.0] * 9


def test_in_a_run_the_channel_alone_is_correlated_and_all_others_draw_as_before():
    overrides = {"physics.engine": "kinematic", "time_limit": 20.0, "people": [], "robot.goal": [90.0, 0.0]}
    errors = {}
    for tau in (None, 1.0):
        more = {} if tau is None else {"noise.correlation_time": {"pose": {"x": tau}}}
        scenario = mjnav.load_scenario("crossing1", {**overrides, **more}, seed=1)
        with mjnav.Simulation(scenario, log=False) as simulation:
            rows = []
            while not simulation.done:
                rows += [reading.pose - simulation.truth.robot_pose for reading in simulation.readings]
                simulation.step(0.0, 0.0)
        errors[tau] = np.array(rows)
    assert np.array_equal(errors[None][:, 1:], errors[1.0][:, 1:])
    after = {tau: np.corrcoef(e[1:, 0], e[:-1, 0])[0, 1] for tau, e in errors.items()}
    assert abs(after[None]) < 0.2
    assert after[1.0] == pytest.approx(np.exp(-0.1), abs=0.12)
    assert errors[1.0][:, 0].std() < 3.0 * profile("pearson")["pose.x"].std
