"""Reliability curves and calibration errors: exact answers, limits, and a literal reference."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.errors import InvalidValue
from mjnav.metrics.prediction import EDGES, calibration

SHARE = st.floats(0.0, 1.0)
FORECASTS = st.lists(st.tuples(SHARE, SHARE, st.integers(0, 4)), min_size=1, max_size=40)


def of(predicted, observed, groups=None, **options):
    groups = np.arange(len(predicted)) if groups is None else groups
    return calibration(predicted, observed, groups, np.random.default_rng(1), resamples=500, **options)


def test_a_small_case_has_its_exact_answer():
    c = of([0.0, 0.3, 0.35, 0.9], [0.0, 0.0, 1.0, 1.0])
    assert (c.count, c.num_groups) == (4, 4)
    assert (c.predicted, c.observed, c.bias) == pytest.approx((0.3875, 0.5, -0.1125))
    assert c.ece == pytest.approx((1 * 0.0 + 2 * abs(0.325 - 0.5) + 1 * 0.1) / 4)
    assert c.brier == pytest.approx((0.0 + 0.3**2 + 0.65**2 + 0.1**2) / 4)
    filled = {(b.low, b.high): (b.count, b.predicted, b.observed) for b in c.bins if b.count}
    assert list(filled) == [(0.0, 0.0), (0.2, 0.4), (0.8, 1.0)]
    assert filled[0.0, 0.0] == (1, 0.0, 0.0)
    assert filled[0.2, 0.4] == (2, pytest.approx(0.325), 0.5)
    assert filled[0.8, 1.0] == (1, 0.9, 1.0)


def test_none_at_all_is_a_bin_of_its_own_and_an_edge_belongs_to_the_bin_below():
    counts = [b.count for b in of([0.0, 1e-12, *EDGES[1:]], np.zeros(len(EDGES) + 1)).bins]
    assert counts == [1, 2, *[1] * (len(EDGES) - 2)]


@given(FORECASTS)
def test_every_figure_is_that_of_its_definition(forecasts):
    c = of(*map(list, zip(*forecasts, strict=True)))
    p, q = [f[0] for f in forecasts], [f[1] for f in forecasts]
    ece = 0.0
    for low, high, found in zip((-1.0, *EDGES), EDGES, c.bins, strict=False):
        members = [i for i in range(len(p)) if low < p[i] <= high]
        assert found.count == len(members)
        if members:
            predicted, observed = sum(p[i] for i in members) / len(members), sum(q[i] for i in members) / len(members)
            assert (found.predicted, found.observed) == pytest.approx((predicted, observed), abs=1e-12)
            ece += len(members) / len(p) * abs(predicted - observed)
        else:
            assert (found.predicted, found.observed, found.observed_interval) == (None, None, None)
    assert c.ece == pytest.approx(ece, abs=1e-12)
    assert c.bias == pytest.approx(sum(p) / len(p) - sum(q) / len(q), abs=1e-12)
    assert abs(c.bias) <= c.ece + 1e-12


@given(FORECASTS, st.randoms(use_true_random=False))
def test_the_order_of_forecasts_means_nothing(forecasts, random):
    shuffled = list(forecasts)
    random.shuffle(shuffled)
    one, other = (of(*map(list, zip(*rows, strict=True))) for rows in (forecasts, shuffled))
    for key in ("predicted", "observed", "bias", "ece", "brier", "bias_interval", "ece_interval"):
        assert getattr(one, key) == pytest.approx(getattr(other, key), abs=1e-9)


@pytest.mark.parametrize("num", [1_000, 100_000])
def test_the_error_of_perfect_forecasts_goes_to_zero_as_they_grow(num):
    rng = np.random.default_rng(2)
    p = rng.beta(0.5, 2.0, num)
    c = of(p, rng.random(num) < p, np.arange(num) % 20)
    # E |pred_b - obs_b| <= std / sqrt(n_b), summed with weights n_b / n over B bins: at most sqrt(B / 4 n).
    assert c.ece is not None
    assert 0.0 < c.ece < np.sqrt(len(EDGES) / (4 * num))
    assert abs(c.bias) < 4 * 0.5 / np.sqrt(num)
    assert c.brier == pytest.approx((p * (1.0 - p)).mean(), abs=4 * 0.5 / np.sqrt(num))


@pytest.mark.parametrize("bias", [-0.05, 0.0, 0.1])
def test_a_constant_bias_is_the_error(bias):
    q = np.random.default_rng(3).uniform(0.1, 0.85, 500)
    c = of(q + bias, q)
    assert (c.bias, c.ece) == pytest.approx((bias, abs(bias)))
    assert c.bias_interval == pytest.approx((bias, bias))


def test_brier_of_a_frequency_is_the_mean_over_its_outcomes():
    share, outcomes = 0.3, [1.0] * 3 + [0.0] * 7
    assert of([0.4], [share]).brier == pytest.approx(of([0.4] * 10, outcomes).brier)


def test_intervals_count_groups_and_not_the_forecasts_in_them():
    rng = np.random.default_rng(4)
    p, q, groups = rng.random(30), rng.random(30), np.repeat(np.arange(10), 3)
    one, often = of(p, q, groups), of(np.tile(p, 50), np.tile(q, 50), np.tile(groups, 50))
    assert often.bias_interval == pytest.approx(one.bias_interval)
    assert often.ece_interval == pytest.approx(one.ece_interval)
    for found, expected in zip(often.bins, one.bins, strict=True):
        assert found.observed_interval == pytest.approx(expected.observed_interval)


def test_resamples_too_many_to_be_drawn_at_once_are_all_drawn():
    rng = np.random.default_rng(7)
    p, q = rng.random(10_001), rng.random(10_001)
    c = calibration(p, q, np.arange(10_001), np.random.default_rng(8), resamples=1_001)
    half = 1.96 * (p - q).std() / np.sqrt(10_001)
    assert c.bias_interval == pytest.approx((c.bias - half, c.bias + half), abs=0.15 * half)


def test_two_groups_are_enough_for_an_interval():
    # The two draws of one group twice have probability 1/4 each: the interval's ends.
    c = of([0.3, 0.4], [0.0, 1.0])
    assert c.bias_interval == pytest.approx((-0.6, 0.3))


def test_forecasts_of_no_risk_at_all_have_an_interval_of_how_often_it_came_true():
    c = of([0.0, 0.0, 0.3], [0.0, 1.0, 1.0])
    assert (c.bins[0].observed, c.bins[0].observed_interval) == (0.5, (0.0, 1.0))


def test_one_group_says_nothing_of_how_groups_differ():
    c = of([0.3, 0.4], [0.0, 1.0], [7, 7])
    assert (c.num_groups, c.bias_interval, c.ece_interval) == (1, None, None)
    mixed = of([0.3, 0.4, 0.9, 0.95], [0.0, 1.0, 1.0, 1.0], [0, 1, 2, 2])
    intervals = {b.high: b.observed_interval for b in mixed.bins if b.count}
    assert intervals[0.4] == (0.0, 1.0)
    assert intervals[1.0] is None


def test_without_forecasts_there_is_nothing_to_say():
    c = of([], [])
    assert (c.count, c.num_groups, c.ece, c.bias, c.brier, c.ece_interval) == (0, 0, None, None, None, None)
    assert [b.count for b in c.bins] == [0] * len(EDGES)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"predicted": [0.5, 1.5]}, "predicted: found"),
        ({"observed": [0.5, np.nan]}, "observed: found"),
        ({"groups": [0]}, "allowed: as many as there are forecasts (2)"),
        ({"edges": (0.1, 1.0)}, "edges: found (0.1, 1.0)"),
        ({"edges": (0.0, 0.5, 0.5, 1.0)}, "numbers that rise from 0 to 1"),
    ],
)
def test_bad_input_is_refused_by_its_name(arguments, message):
    arguments = {"predicted": [0.1, 0.2], "observed": [0.0, 1.0], "groups": [0, 1]} | arguments
    with pytest.raises(InvalidValue) as error:
        calibration(rng=np.random.default_rng(0), **arguments)
    assert message in str(error.value)


def test_all_forecasts_above_0_may_be_in_one_bin():
    c = of([0.1, 0.8], [0.5, 0.6], edges=(0.0, 1.0))
    assert [b.count for b in c.bins] == [0, 2]
    assert c.bias is not None
    assert c.ece == pytest.approx(abs(c.bias))
