"""Scores of predictions: small answers by hand, and what makes a score and a region honest."""

from math import hypot, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.metrics.prediction import path_scores

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
