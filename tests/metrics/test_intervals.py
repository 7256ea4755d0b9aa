from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from mjnav.errors import InvalidValue
from mjnav.metrics.intervals import SharedBootstrap, clustered_wilson, holm, mcnemar, wilson


def known(interval: tuple[float, float] | None) -> tuple[float, float]:
    assert interval is not None
    return interval


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [  # Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0000, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilson_gives_the_published_intervals(successes, trials, low, high):
    assert wilson(successes, trials) == pytest.approx((low, high), abs=5e-5)


@given(st.integers(1, 500), st.data())
def test_wilson_equals_scipys_and_mirrors(trials, data):
    successes = data.draw(st.integers(0, trials))
    low, high = known(wilson(successes, trials))
    expected = stats.binomtest(successes, trials).proportion_ci(method="wilson")
    assert (low, high) == pytest.approx((expected.low, expected.high), abs=1e-12)
    assert 0.0 <= low <= successes / trials <= high <= 1.0
    assert wilson(trials - successes, trials) == pytest.approx((1.0 - high, 1.0 - low), abs=1e-12)


def literal(part, whole, rng, resamples=10_000):
    """The studentised interval of sum(part) / sum(whole), written out."""
    ratio, t = part.sum() / whole.sum(), []

    def error(p, w, r):
        return np.sqrt(((p - r * w) ** 2).sum()) / w.sum()

    for _ in range(resamples):
        drawn = rng.integers(len(part), size=len(part))
        p, w = part[drawn], whole[drawn]
        own = p.sum() / w.sum()
        t.append((own - ratio) / error(p, w, own))
    low, high = np.quantile(t, [0.025, 0.975])
    return ratio - high * error(part, whole, ratio), ratio - low * error(part, whole, ratio)


def test_an_interval_is_the_studentised_one_written_out_and_leaves_out_what_is_lacking():
    rng = np.random.default_rng(6)
    values = rng.gamma(2.0, size=150) + 100.0
    values[:5] = np.nan
    shared = SharedBootstrap(150, np.random.default_rng(7))
    low, high = literal(values[5:], np.ones(145), np.random.default_rng(8))
    assert shared.interval(values) == pytest.approx((low, high), abs=0.04 * (high - low))
    assert shared.interval(np.full(150, np.nan)) is None
    assert shared.interval(np.full(150, 0.25)) == (0.25, 0.25)


def test_intervals_of_skewed_costs_hold_the_mean_in_95_of_100_cases():
    """Of 20 exponential costs the ends of a percentile interval hold it in 90 or 91."""
    rng, shared = np.random.default_rng(3), SharedBootstrap(20, np.random.default_rng(4), resamples=2000)
    costs = rng.exponential(size=(1500, 20))
    covered = sum(low <= 1.0 <= high for low, high in map(known, shared.intervals(costs)))
    assert stats.binomtest(covered, 1500, 0.95).pvalue > 1e-3


def test_few_values_and_values_that_are_mostly_alike_have_the_quantiles_of_resamples():
    shared = SharedBootstrap(3, np.random.default_rng(5))
    assert shared.interval([1.0, 2.0, 4.0]) == (1.0, 4.0), "a resample in 27 is of the least value alone"
    once = np.eye(20)[0]  # a third of the resamples have zeros alone
    low, high = known(SharedBootstrap(20, np.random.default_rng(5)).interval(once))
    assert (low, high) == pytest.approx(tuple(stats.binom.ppf([0.025, 0.975], 20, 0.05) / 20), abs=1e-6)


@given(st.lists(st.sampled_from([-3.0, 0.6, 0.7, 0.75]), min_size=1, max_size=40), st.integers(0, 5))
def test_no_interval_goes_beyond_the_values(values, seed):
    low, high = known(SharedBootstrap(len(values), np.random.default_rng(seed), resamples=200).interval(values))
    assert min(values) <= low <= high <= max(values)


def test_many_figures_at_once_are_as_each_alone():
    rng = np.random.default_rng(11)
    values = rng.gamma(2.0, size=(6, 30))
    values[1] += 1e3
    values[2, :4] = values[3, ::2] = values[4, 1:] = values[5] = np.nan  # one row knows one seed, one none
    shared = SharedBootstrap(30, np.random.default_rng(12), resamples=500)
    intervals, p_values = shared.intervals(values), shared.p_values(values)
    for row, interval, p in zip(values, intervals, p_values, strict=True):
        assert (interval is None) == np.isnan(row).all() == (p is None)
        if interval is not None:
            assert interval == pytest.approx(shared.interval(row), rel=1e-6)
            assert [p] == shared.p_values([row])
    assert intervals[4] == (values[4, 0], values[4, 0])


def test_intervals_and_p_values_do_not_depend_on_the_unit():
    values = np.random.default_rng(13).normal(0.3, 1.0, 30)
    values[4] = 0.0
    shared = SharedBootstrap(30, np.random.default_rng(14), resamples=500)
    low, high = known(shared.interval(values))
    for unit in (1e-9, 1e9):
        assert shared.interval(unit * values) == pytest.approx((unit * low, unit * high), rel=1e-5, abs=1e-6 * unit)
    for unit in (1e-200, 1e-9, 1e9, 1e200):
        assert shared.p_values([unit * values]) == shared.p_values([values])


def test_p_values_are_uniform_where_nothing_differs_and_small_where_something_does():
    shared = SharedBootstrap(40, np.random.default_rng(9), resamples=2000)
    rng = np.random.default_rng(10)
    found = shared.p_values(rng.standard_t(3, size=(300, 40)))
    assert stats.kstest(found, "uniform").pvalue > 1e-3
    rows = [rng.normal(size=40) + 1.5, np.zeros(40), np.full(40, np.nan)]
    assert shared.p_values(rows) == [pytest.approx(1 / 2001), 1.0, None]


@pytest.mark.parametrize("differences", [(0.1, 0.2, 0.3), (1.0, 1.0, 1.0), (3.0, -1.0, 2.0, 0.7), (0.2, 0.4, -0.1)])
def test_a_p_value_is_the_share_of_all_flips_of_signs_that_reach_as_far(differences):
    num = len(differences)
    flips = [abs(np.dot(signs, differences)) for signs in product((1, -1), repeat=num)]
    share = np.mean(np.array(flips) >= abs(sum(differences)) - 1e-12)
    shared = SharedBootstrap(num, np.random.default_rng(15))
    assert shared.p_values([differences]) == [pytest.approx(share, abs=0.02)]


@pytest.mark.parametrize(("only_a", "only_b"), [(0, 0), (3, 0), (3, 3), (2, 9), (40, 22)])
def test_mcnemars_test_is_the_binomial_one(only_a, only_b):
    n = only_a + only_b
    tail = sum(stats.binom.pmf(k, n, 0.5) for k in range(min(only_a, only_b) + 1))
    assert mcnemar(only_a, only_b) == pytest.approx(min(1.0, 2.0 * tail))


def test_holms_correction_has_the_answers_of_its_definition():
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.5]) == [0.5]
    assert holm([0.6, 0.9]) == [1.0, 1.0]
    assert holm([]) == []


@given(st.lists(st.booleans(), min_size=1, max_size=80))
def test_one_trial_a_unit_has_wilsons_interval(hits):
    assert clustered_wilson(hits, np.ones(len(hits))) == pytest.approx(wilson(sum(hits), len(hits)), abs=1e-12)


def test_trials_that_repeat_each_other_count_once():
    hits = np.random.default_rng(18).random(60) < 0.2
    assert clustered_wilson(5 * hits, np.full(60, 5)) == pytest.approx(wilson(int(hits.sum()), 60), abs=1e-12)
    assert clustered_wilson(np.zeros(60), np.full(60, 5)) == pytest.approx(wilson(0, 60))
    assert clustered_wilson([0.0, 2.0], [0.0, 2.0]) == pytest.approx(wilson(1, 1))  # a unit without trials
    assert clustered_wilson([], []) is None


def test_a_rate_of_units_that_resemble_each_other_is_covered_in_95_of_100_cases():
    rng = np.random.default_rng(19)
    covered = []
    for _ in range(600):
        own = rng.beta(0.5, 4.5, size=150)  # each unit has a rate of its own, 0.1 on average
        trials = rng.integers(1, 7, size=150)
        low, high = known(clustered_wilson(rng.binomial(trials, own), trials))
        covered.append(low <= 0.1 <= high)
    assert stats.binomtest(sum(covered), 600, 0.95).pvalue > 1e-3


def test_a_ratio_of_means_has_the_studentised_interval_written_out():
    rng = np.random.default_rng(20)
    whole = rng.gamma(4.0, size=40)
    part = whole * rng.normal(0.8, 0.1, size=40)
    (found,) = SharedBootstrap(40, np.random.default_rng(21)).ratios([part], [whole])
    low, high = literal(part, whole, rng)
    assert found == pytest.approx((low, high), abs=0.04 * (high - low))


def test_a_ratio_that_all_units_share_is_exact_and_without_wholes_there_is_none():
    whole = np.arange(1.0, 9.0)
    shared = SharedBootstrap(8, np.random.default_rng(22), resamples=200)
    found = shared.ratios([0.5 * whole, 0.0 * whole], [whole, 0.0 * whole])
    assert found == [pytest.approx((0.5, 0.5)), None]


def test_no_trials_have_no_rate():
    assert wilson(0, 0) is None
    with pytest.raises(InvalidValue, match="from 0 to the 3 trials"):
        wilson(4, 3)
