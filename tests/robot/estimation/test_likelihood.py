from itertools import cycle

import numpy as np
import pytest

from mjnav.noise import make_distribution, profile, profile_names
from mjnav.robot.estimation.base import CELLS, FLOOR_WIDTH, LEAST_STD, Likelihood, widened


def test_the_likelihood_mixes_the_density_with_a_floor(pearson):
    noise = pearson["pose.x"]
    model = Likelihood.of("pose.x", noise, 0.01)
    error = np.array([-0.05, 0.0, 0.1, 50.0])
    expected = 0.99 * np.exp(noise.logpdf(error)) + 0.01 / FLOOR_WIDTH["pose.x"]
    assert model.exact_density(error) == pytest.approx(expected, rel=1e-12)
    assert model.density(error) == pytest.approx(expected, rel=1e-4)
    assert model.density(error)[3] == pytest.approx(model.floor, rel=1e-6)


@pytest.mark.parametrize(("name", "channel"), list(zip(profile_names(), cycle(FLOOR_WIDTH))))
def test_a_tabulated_density_is_within_half_a_cell_and_exact_on_average(name, channel):
    model = Likelihood.of(channel, profile(name)[channel], 0.01)
    cell = model.noise.std / CELLS
    rng = np.random.default_rng(0)
    error = np.append(model.noise.sample(rng, 50_000), model.noise.std * rng.uniform(-80.0, 80.0, 50_000))
    found, exact = model.density(error), model.exact_density(error)
    near = [model.exact_density(error + shift * cell) for shift in np.linspace(-1.0, 1.0, 9)]
    assert np.all(found >= np.min(near, axis=0) * (1.0 - 1e-3))
    assert np.all(found <= np.max(near, axis=0) * (1.0 + 1e-3))
    assert np.mean(np.abs(found / exact - 1.0)[:50_000]) < 2e-4


@pytest.mark.parametrize(
    "noise",
    [
        make_distribution("student_t", std=0.1, df=2.1),  # its tails do not end
        make_distribution("mixture", weights=[0.5, 0.5], means=[0.0, 1.0], stds=[1e-4, 1.0]),  # a spike
        make_distribution("pearson", mean=0.0, std=0.1, skew=0.0, kurtosis=1.05),  # infinite at both ends
    ],
)
def test_a_density_that_no_table_holds_is_computed(noise):
    model = Likelihood(noise, 0.01, 10.0)
    error = np.linspace(-0.3, 0.3, 1001)
    assert np.array_equal(model.density(error), model.exact_density(error))


@pytest.mark.parametrize("channel", LEAST_STD)
def test_a_channel_without_noise_is_believed_to_have_the_least(channel):
    least = LEAST_STD[channel]
    narrow = widened(channel, make_distribution("gaussian", mean=0.5, std=0.1 * least))
    assert (narrow.mean, narrow.std) == pytest.approx((0.5, least))
    wide = make_distribution("gaussian", mean=0.5, std=2.0 * least)
    assert widened(channel, wide) is wide
