import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from mjnav.errors import InvalidValue
from mjnav.noise import Empirical, Gaussian, Mixture, Pearson, StudentT, Uniform, Zero, make_distribution

SAMPLES = tuple(np.random.default_rng(1).gamma(2.0, 0.3, 60).tolist())
EVERY = {
    "gaussian": Gaussian(mean=0.2, std=0.5),
    "uniform": Uniform(mean=-0.1, half_width=0.4),
    "student_t": StudentT(mean=1.0, std=0.3, df=5.0),
    "mixture": Mixture(weights=(0.4, 0.6), means=(-0.9, 1.0), stds=(0.1, 0.6)),
    "empirical": Empirical(samples=SAMPLES),
    "pearson": Pearson(mean=0.1, std=0.07, skew=1.1, kurtosis=14.0),
}
every_distribution = pytest.mark.parametrize("noise", EVERY.values(), ids=EVERY.keys())


@every_distribution
def test_density_integrates_to_one_and_has_its_mean_and_std(quadrature, noise):
    integral = quadrature(noise)
    mean, std, _, _ = integral.moments()
    assert integral.total == pytest.approx(1.0, abs=1e-9)
    assert mean == pytest.approx(noise.mean, abs=1e-9)
    assert std == pytest.approx(noise.std, rel=1e-7)


@every_distribution
def test_samples_follow_the_density(quadrature, noise):
    draws = noise.sample(np.random.default_rng(11), 20_000)
    assert stats.kstest(draws, quadrature(noise).cdf).pvalue > 1e-3


@pytest.mark.parametrize("noise", [*EVERY.values(), Zero()], ids=[*EVERY.keys(), "zero"])
def test_same_stream_gives_same_draws_of_the_shape_asked_for(noise):
    for size in (0, 1, 7, (3, 4), ()):
        one, other = (np.asarray(noise.sample(np.random.default_rng(4), size)) for _ in range(2))
        assert one.shape == (size if isinstance(size, tuple) else (size,))
        np.testing.assert_array_equal(one, other)
        assert np.shape(noise.logpdf(one)) == one.shape


@pytest.mark.parametrize("noise", [*EVERY.values(), Zero()], ids=[*EVERY.keys(), "zero"])
@given(x=st.lists(st.floats(allow_nan=False), min_size=1))
@settings(max_examples=30, deadline=None)
def test_log_density_is_never_nan_and_never_plus_infinity(noise, x):
    values = noise.logpdf(x)
    assert not np.isnan(values).any()
    assert (values < np.inf).all()


def test_zero_is_exactly_zero_takes_no_randomness_and_has_a_finite_log_density():
    rng = np.random.default_rng(0)
    noise = Zero()
    assert not noise.sample(rng, 100).any()
    assert rng.random() == np.random.default_rng(0).random()
    assert (noise.mean, noise.std) == (0.0, 0.0)
    np.testing.assert_allclose(noise.logpdf([0.0, 2e-3]), stats.norm.logpdf([0.0, 2e-3], 0.0, 1e-3))


@given(mean=st.floats(-3, 3), std=st.floats(0.01, 3), df=st.floats(2.1, 1e6), x=st.floats(-10, 10))
@settings(deadline=None)
def test_densities_equal_scipys(mean, std, df, x):
    assert Gaussian(mean=mean, std=std).logpdf(x) == pytest.approx(stats.norm.logpdf(x, mean, std))
    scale = std * np.sqrt((df - 2.0) / df)
    expected = stats.t.logpdf(x, df, mean, scale)
    assert StudentT(mean=mean, std=std, df=df).logpdf(x) == pytest.approx(expected, abs=1e-7, rel=1e-9)
    inside = abs(x - mean) <= std
    assert Uniform(mean=mean, half_width=std).logpdf(x) == (-np.log(2.0 * std) if inside else -np.inf)


def test_mixture_of_two_has_the_density_and_moments_of_a_literal_sum():
    noise = Mixture(weights=[0.25, 0.75], means=[-1, 3], stds=[1, 2])
    x = np.array([-4.0, 0.0, 2.5])
    literal = 0.25 * stats.norm.pdf(x, -1, 1) + 0.75 * stats.norm.pdf(x, 3, 2)
    np.testing.assert_allclose(noise.logpdf(x), np.log(literal), rtol=1e-13)
    assert noise.mean == 2.0
    assert noise.std**2 == pytest.approx(0.25 * 1 + 0.75 * 4 + 0.25 * 9 + 0.75 * 1)


def test_empirical_density_is_a_literal_sum_of_kernels_of_silvermans_width():
    noise = Empirical(samples=SAMPLES)
    data = np.array(SAMPLES)
    h = 0.9 * min(data.std(), stats.iqr(data) / 1.34) * len(data) ** -0.2
    assert noise.bandwidth == pytest.approx(h)
    x = np.linspace(-0.5, 3.0, 8)
    literal = stats.norm.pdf(x[:, None], data, h).mean(axis=1)
    np.testing.assert_allclose(noise.logpdf(x), np.log(literal), rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "arguments", "key", "message"),
    [
        ("pearsn", {}, "distribution", "found 'pearsn'; allowed: .*did you mean 'pearson'"),
        ("pearson", {"std": 1, "skew": 1, "kurtosi": 5}, "kurtosi", "allowed: .*did you mean 'kurtosis'"),
        ("gaussian", {}, "std", "a number > 0 and <= 10000; this key is required$"),
        ("gaussian", {"std": float("nan")}, "std", "found nan"),
        ("mixture", {"weights": [0.4, 0.4], "means": [0, 1], "stds": [1, 1]}, "weights", r"sum is 1, not 0\.8"),
        ("mixture", {"weights": [0.4, 0.6], "means": [0], "stds": [1, 1]}, "means", "as many numbers as weights: 2"),
        ("empirical", {"samples": [1.0, 1.0]}, "samples", "two different numbers"),
    ],
)
def test_a_wrong_argument_is_named_with_what_is_allowed(name, arguments, key, message):
    with pytest.raises(InvalidValue, match=message) as error:
        make_distribution(name, **arguments)
    assert error.value.key == key


def test_import_brings_neither_scipy_nor_numba():
    code = "import sys, mjnav.noise; print({'scipy', 'numba'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
