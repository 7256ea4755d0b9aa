import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.optimize import brentq
from scipy.special import loggamma

from mjnav.errors import InvalidValue
from mjnav.noise import Pearson, pearson_type
from mjnav.noise.pearson_iv import TypeIVLaw, complex_log1p, stirling_remainder


def inverse_gamma_kurtosis(skew):
    """The kurtosis for which the roots of Pearson's denominator meet."""

    def gap(kurtosis):
        b0, b2 = 4 * kurtosis - 3 * skew**2, 2 * kurtosis - 3 * skew**2 - 6
        return (skew * (kurtosis + 3)) ** 2 - 4 * b0 * b2

    return brentq(gap, 3 + 1.5 * skew**2 + 1e-12, 3 + 4 * skew**2 + 5, xtol=1e-15, rtol=1e-15)


# Two members of each type, of both signs where there are two.
MEMBERS = {
    "0": [(0.0, 3.0)],
    "I": [(1.2, 4.0), (-0.5, 2.5), (-2.0, 8.4)],
    "II": [(0.0, 1.8), (0.0, 2.6)],
    "III": [(2.0, 9.0), (-0.7, 3.0 + 1.5 * 0.49)],
    "IV": [(1.1, 14.0), (-1.0, 5.0), (0.1, 3.1), (-3.0, 40.0)],
    "V": [(1.0, inverse_gamma_kurtosis(1.0)), (-0.3, inverse_gamma_kurtosis(0.3))],
    "VI": [(1.5, 6.4), (-1.2, 5.2), (2.5, 13.5)],
    "VII": [(0.0, 4.0), (0.0, 30.0)],
}
EVERY_MEMBER = [(kind, *moments) for kind, members in MEMBERS.items() for moments in members]


@st.composite
def possible_moments(draw):
    """(skew, kurtosis) over every type; beta shapes below 1/2 hide mass between neighbouring floats, so not those."""
    skew = draw(st.one_of(st.just(0.0), st.floats(-3.0, 3.0)))
    boundaries = [3.0 + 1.5 * skew**2] + ([inverse_gamma_kurtosis(abs(skew))] if 0.1 < abs(skew) < 2.0 else [])
    distance = st.floats(-6.0, 0.0).flatmap(lambda e: st.sampled_from([10.0**e, -(10.0**e)]))
    near = st.builds(lambda b, d: b + d, st.sampled_from(boundaries), distance)
    kurtosis = draw(st.one_of(st.floats(skew**2 + 1.2, skew**2 + 30.0), near, st.sampled_from(boundaries)))
    assume(kurtosis > skew**2 + 1.1)
    if pearson_type(skew, kurtosis) in ("I", "II"):
        n = 6 * (kurtosis - skew**2 - 1) / (6 + 3 * skew**2 - 2 * kurtosis)
        assume(0.5 * n * (1 - (n + 2) * np.sqrt(skew**2 / (skew**2 * (n + 2) ** 2 + 16 * (n + 1)))) >= 0.5)
    return skew, kurtosis


@pytest.mark.parametrize(("kind", "skew", "kurtosis"), EVERY_MEMBER)
def test_moments_have_the_type_of_the_textbook(kind, skew, kurtosis):
    assert pearson_type(skew, kurtosis) == kind
    assert Pearson(std=2.0, skew=skew, kurtosis=kurtosis).type == kind


@given(possible_moments(), st.floats(-5.0, 5.0), st.floats(0.01, 10.0))
@settings(max_examples=150, deadline=None)
def test_density_has_the_four_moments_asked_for(quadrature, moments, mean, std):
    # A gamma end of shape 4 / skew^2 < 1/2 hides mass between neighbouring floats, the more the further it is from 0.
    assume(moments[0] ** 2 <= 8.0 or abs(mean) <= 10.0 * std)
    noise = Pearson(mean=mean, std=std, skew=moments[0], kurtosis=moments[1])
    integral = quadrature(noise)
    assert integral.total == pytest.approx(1.0, abs=1e-6)
    found = integral.moments()
    assert found[0] == pytest.approx(mean, abs=1e-6 * std)
    assert found[1] == pytest.approx(std, rel=1e-6)
    assert found[2] == pytest.approx(moments[0], abs=1e-5)
    assert found[3] == pytest.approx(moments[1], rel=1e-5)


@given(possible_moments(), st.floats(-2.0, 3.0))
@settings(max_examples=150, deadline=None)
def test_density_solves_pearsons_equation(moments, z):
    skew, kurtosis = moments
    noise = Pearson(std=1.0, skew=skew, kurtosis=kurtosis)
    b0, b1, b2 = 4 * kurtosis - 3 * skew**2, skew * (kurtosis + 3), 2 * kurtosis - 3 * skew**2 - 6
    d = 10 * kurtosis - 12 * skew**2 - 18
    denominator = b0 + b1 * z + b2 * z * z
    h = 1e-4
    assume(noise.support[0] + 0.05 < z < noise.support[1] - 0.05)
    assume(abs(denominator) > 0.2 * b0)
    below, above = noise.logpdf([z - h, z + h])
    slope = -(b1 + d * z) / denominator
    assert (above - below) / (2 * h) == pytest.approx(slope, abs=1e-5 * (1.0 + abs(slope)))


@pytest.mark.parametrize(("kind", "skew", "kurtosis"), EVERY_MEMBER)
def test_samples_follow_the_density(quadrature, kind, skew, kurtosis):
    noise = Pearson(mean=0.3, std=0.2, skew=skew, kurtosis=kurtosis)
    draws = noise.sample(np.random.default_rng(7), 20_000)
    assert np.isfinite(noise.logpdf(draws)).all()
    assert stats.kstest(draws, quadrature(noise).cdf).pvalue > 1e-3


@pytest.mark.parametrize(
    "reference",
    [
        stats.norm(0.4, 1.7),
        stats.beta(2.0, 5.0, loc=-1.0, scale=3.0),
        stats.beta(4.0, 0.8, loc=-1.0, scale=3.0),
        stats.beta(1.5, 1.5),
        stats.uniform(-2.0, 5.0),
        stats.expon(1.0, 2.0),
        stats.gamma(7.5),
        stats.invgamma(6.0),
        stats.betaprime(3.0, 9.0, loc=2.0, scale=0.1),
        stats.betaprime(0.7, 40.0),
        stats.t(5.0, 0.1, 3.0),
        stats.t(60.0),
    ],
    ids=lambda frozen: frozen.dist.name,
)
def test_density_equals_the_named_one_with_its_moments(reference):
    mean, variance, skew, excess = (float(m) for m in reference.stats("mvsk"))
    noise = Pearson(mean=mean, std=variance**0.5, skew=skew, kurtosis=excess + 3.0)
    x = reference.ppf(np.linspace(0.001, 0.999, 101))
    np.testing.assert_allclose(noise.logpdf(x), reference.logpdf(x), atol=1e-8)
    np.testing.assert_allclose(noise.support, reference.support(), atol=1e-12)


def test_kurtosis_below_the_least_possible_is_refused_with_the_least():
    with pytest.raises(InvalidValue, match=r"kurtosis: found 1\.2; allowed: a number > skew² \+ 1 = 2\.44") as error:
        Pearson(std=1.0, skew=1.2, kurtosis=1.2)
    assert error.value.key == "kurtosis"


@given(possible_moments(), st.lists(st.floats(allow_nan=False), min_size=1))
@settings(max_examples=100, deadline=None)
def test_log_density_is_never_nan_and_never_plus_infinity(moments, x):
    noise = Pearson(mean=0.1, std=0.01, skew=moments[0], kurtosis=moments[1])
    ends = [end for end in noise.support if np.isfinite(end)]
    values = noise.logpdf(x + ends)
    assert not np.isnan(values).any()
    assert (values < np.inf).all()


def test_compiled_rejection_accepts_what_searches_and_formulas_on_arrays_accept():
    law = TypeIVLaw.of(r=9.0, skew=0.8)
    stairs = law.staircase
    u = np.random.default_rng(8).random((2, 4000 + 4000 // 8 + 4))
    area = u[0] * stairs.area[-1]
    step = np.searchsorted(stairs.area, area, side="right") - 1
    psi = stairs.left[step] + (area - stairs.area[step]) / stairs.high[step]
    g = np.exp(law.r * (np.log(np.cos(psi) - law.t0 * np.sin(psi)) + law.t0 * psi))
    expected = psi[u[1] * stairs.high[step] <= g]
    assert 4000 < expected.size < psi.size
    assert np.array_equal(law._accepted(np.random.default_rng(8), 4000), expected[:4000])


@pytest.mark.parametrize("z", [0.01, 0.5, 1.0, 2.5, 11.9, 40.0, 2.5 + 7j, 3.0 - 0.1j, 4.0 + 60j])
def test_stirlings_formula_with_its_remainder_is_the_log_of_the_gamma_function(z):
    leading = (z - 0.5) * np.log(z) - z + 0.5 * np.log(2 * np.pi)
    assert stirling_remainder(z) == pytest.approx(np.real(loggamma(z) - leading), abs=3e-14)


def test_complex_log1p_keeps_the_digits_of_a_small_argument():
    u = 1e-12 + 1e-13j
    assert complex_log1p(u) == pytest.approx(u - u * u / 2, rel=1e-15)
    assert complex_log1p(1 - 2j) == pytest.approx(np.log(2 - 2j), rel=1e-15)
