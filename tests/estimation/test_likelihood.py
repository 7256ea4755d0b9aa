import numpy as np
import pytest

from mjnav.estimation.likelihood import FLOOR_WIDTH, LEAST_STD, Likelihood, widened
from mjnav.noise import make_distribution


def test_the_likelihood_mixes_the_density_with_a_floor(pearson):
    noise = pearson["pose.x"]
    model = Likelihood.of("pose.x", noise, 0.01)
    error = np.array([-0.05, 0.0, 0.1, 50.0])
    expected = 0.99 * np.exp(noise.logpdf(error)) + 0.01 / FLOOR_WIDTH["pose.x"]
    assert model.density(error) == pytest.approx(expected, rel=1e-12)
    assert model.density(error)[3] == pytest.approx(model.floor, rel=1e-6)


def test_no_error_is_impossible_where_the_noise_has_bounded_support():
    model = Likelihood.of("detection.x", make_distribution("uniform", half_width=0.1), 0.01)
    assert model.density(np.array([-0.2, 0.0, 0.2])) == pytest.approx([1e-3, 0.99 * 5.0 + 1e-3, 1e-3])


def test_an_infinite_density_gives_a_finite_weight():
    class Edge:
        mean, std = 0.0, 1.0

        def logpdf(self, x):
            return np.where(x == 0.0, np.inf, -1.0)

    assert np.isfinite(Likelihood.of("pose.x", Edge(), 0.01).density(np.array([0.0, 1.0]))).all()


@pytest.mark.parametrize("channel", LEAST_STD)
def test_a_channel_without_noise_is_believed_to_have_the_least(channel):
    least = LEAST_STD[channel]
    narrow = widened(channel, make_distribution("gaussian", mean=0.5, std=0.1 * least))
    assert (narrow.mean, narrow.std) == pytest.approx((0.5, least))
    wide = make_distribution("gaussian", mean=0.5, std=2.0 * least)
    assert widened(channel, wide) is wide
