"""Scores of predictions: small answers by hand, and what makes a score and a region honest."""

from math import hypot, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.metrics.prediction import EDGES, calibration, path_scores

PLACE = st.tuples(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))


def energy_score(samples, observed):
    return path_scores(samples[:, None], observed[None]).energy[0]


def test_the_energy_score_of_two_points_by_hand():
    # |(0, 0) - (0, 3)| = 3, |(4, 0) - (0, 3)| = 5, and the two are 4 apart in two of four pairs.
    assert energy_score(np.array([[0.0, 0.0], [4.0, 0.0]]), np.array([0.0, 3.0])) == pytest.approx(4.0 - 0.5 * 2.0)


@given(PLACE, PLACE)
def test_the_energy_score_of_one_point_is_its_distance(x, y):
    assert energy_score(np.array([x]), np.array(y)) == pytest.approx(hypot(x[0] - y[0], x[1] - y[1]), abs=1e-12)


@given(st.integers(0, 10_000), st.floats(0.05, 3.0))
def test_nothing_scores_less_on_average_than_the_distribution_itself(seed, shift):
    """A forecast of the points that may happen against one that is elsewhere, wider, or lacks some; over all cases."""
    points = np.random.default_rng(seed).normal(size=(6, 2))
    others = (
        points + np.array([shift, 0.0]),
        points.mean(axis=0) + (1.0 + shift) * (points - points.mean(axis=0)),
        points[:3],
    )
    honest = np.mean([energy_score(points, y) for y in points])
    for other in others:
        assert honest <= np.mean([energy_score(other, y) for y in points]) + 1e-12


def test_displacements_by_hand():
    paths = np.array([[[1.0, 0.0], [2.0, 0.0]], [[1.0, 2.0], [2.0, 4.0]]])
    found = path_scores(paths, np.array([[1.0, 0.0], [2.0, 0.0]]))
    assert found.error.tolist() == [1.0, 2.0]  # of the means (1, 1) and (2, 2)
    assert (found.error.mean(), found.error[-1], found.min_ade) == (1.5, 2.0, 0.0)
    beyond = path_scores(paths, np.array([[1.0, 0.0], [np.nan, np.nan]]))
    assert beyond.error[0] == 1.0
    assert np.isnan([beyond.error[1], beyond.energy[1], *beyond.inside[1]]).all()


@pytest.mark.parametrize("num", [9, 25])
def test_what_comes_from_the_samples_distribution_lies_inside_as_often_as_is_said(num):
    """Of two far parts, one of them three times as likely: no ellipse would hold for it."""
    rng, runs = np.random.default_rng(0), 4000
    centre = np.where(rng.random((num + 1, runs)) < 0.75, 0.0, 20.0)
    points = rng.normal(size=(num + 1, runs, 2)) + centre[..., None]
    inside = path_scores(points[:num], points[num]).inside.mean(axis=0)
    assert inside == pytest.approx([0.5, 0.9, 0.95], abs=4.0 * sqrt(0.25 / runs))


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


def test_samples_that_are_all_alike_hold_nothing_else_and_a_wide_spread_all():
    point, y = np.zeros((30, 1, 2)), np.array([[0.1, 0.0]])
    assert path_scores(point, y).inside.tolist() == [[0.0, 0.0, 0.0]]
    assert np.isnan(path_scores(point[:1], y).inside).all()
    wide = 50.0 * np.random.default_rng(1).normal(size=(30, 1, 2))
    middle = wide[np.argsort(np.hypot(*wide[:, 0].T))[:1], 0]
    assert path_scores(wide, middle + 0.01).inside[0, 2] == 1.0


def test_two_groups_are_enough_for_an_interval():
    # The two draws of one group twice have probability 1/4 each: the interval's ends.
    c = of([0.3, 0.4], [0.0, 1.0])
    assert c.bias_interval == pytest.approx((-0.6, 0.3))
