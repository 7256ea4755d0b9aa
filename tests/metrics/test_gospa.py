"""GOSPA on small exact cases, against all assignments, and against Stone Soup's."""

from datetime import datetime
from itertools import combinations, permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from stonesoup.metricgenerator.ospametric import GOSPAMetric
from stonesoup.types.state import State

from mjnav.metrics.tracking import CUTOFF, gospa, gospa_squared
from mjnav.scene.spec import Estimation, ObstacleEstimation

# Coordinates on a grid, so that ties and pairs at the cut-off itself come up.
points = st.lists(st.tuples(*[st.integers(0, 12).map(lambda n: 0.25 * n)] * 2), max_size=4)


def padded(*ticks) -> np.ndarray:
    """Sets of points as one array (t, n, 2)."""
    found = np.full((len(ticks), max(map(len, ticks)), 2), np.nan)
    for row, tick in zip(found, ticks, strict=True):
        row[: len(tick)] = np.reshape(tick, (-1, 2))
    return found


def over_all_pairings(people, tracks, cutoff=CUTOFF) -> float:
    """GOSPA^2 as its proposition 1 defines it: the least over all sets of pairs."""
    squared = [[(x - u) ** 2 + (y - v) ** 2 for u, v in tracks] for x, y in people]
    return min(
        sum(squared[i][j] for i, j in zip(some, others, strict=True))
        + cutoff**2 / 2 * (len(people) + len(tracks) - 2 * size)
        for size in range(min(len(people), len(tracks)) + 1)
        for some in combinations(range(len(people)), size)
        for others in permutations(range(len(tracks)), size)
    )


@pytest.mark.parametrize(
    ("people", "tracks", "parts"),
    [
        ([], [], (0.0, 0.0, 0.0)),
        ([(0, 0)], [(0.3, 0.4)], (0.25, 0.0, 0.0)),
        ([(0, 0)], [], (0.0, 0.5, 0.0)),
        ([], [(0, 0), (5, 5)], (0.0, 0.0, 1.0)),
        ([(0, 0)], [(3, 0)], (0.0, 0.5, 0.5)),  # too far: missed, and a false track
        ([(0, 0), (0.6, 0)], [(0.5, 0)], (0.01, 0.5, 0.0)),  # the nearer person has the track
        ([(0, 0), (0.5, 0)], [(0.4, 0), (-0.9, 0)], (0.01 + 0.81, 0.0, 0.0)),
        ([(0, 0), (0.5, 0)], [(0.4, 0), (1.3, 0)], (0.16 + 0.64, 0.0, 0.0)),  # a greedy choice would pay 0.01 + 1
    ],
)
def test_small_cases_by_hand(people, tracks, parts):
    found = gospa_squared(padded(people), padded(tracks))
    np.testing.assert_allclose(found, [parts], atol=1e-15)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(points, points), min_size=1, max_size=3), st.sampled_from([0.5, 1.0, 2.0]))
def test_it_is_the_least_over_all_pairings(ticks, cutoff):
    people, tracks = (padded(*(tick[side] for tick in ticks)) for side in (0, 1))
    found = gospa_squared(people, tracks, cutoff)
    expected = [over_all_pairings(one, other, cutoff) for one, other in ticks]
    np.testing.assert_allclose(found.sum(axis=1), expected, atol=1e-12)
    swapped = gospa_squared(tracks, people, cutoff)
    np.testing.assert_allclose(swapped.sum(axis=1), expected, atol=1e-12)  # it is a metric


def test_it_equals_stone_soups():
    rng, now = np.random.default_rng(4), datetime(2026, 1, 1)
    metric = GOSPAMetric(c=CUTOFF, p=2)
    for sizes in [*product(range(5), range(5))][1:] * 3:  # it takes no two empty sets
        sets = [rng.uniform(0.0, 2.0, (size, 2)) for size in sizes]
        tracks, people = ([State(point[:, None], timestamp=now) for point in points] for points in sets)
        value = metric.compute_gospa_metric(tracks, people)[0].value
        (found,) = gospa_squared(sets[1][None], sets[0][None])
        assert np.sqrt(found.sum()) == pytest.approx(value["distance"], abs=1e-12)
        theirs = [value["localisation"], value["missed"], value["false"]]
        np.testing.assert_allclose(found, theirs, atol=1e-12)


def test_over_a_run_it_is_the_root_of_the_mean_square_and_its_parts_add_up(trajectory_through, scenario_with):
    people = np.array([[[1.0, 0.0]], [[2.0, 0.0]], [[np.nan] * 2], [[4.0, 0.0]]])
    tracks = np.array([[[1.3, 0.4, 0, 0]], [[np.nan] * 4], [[3.0, 0.0, 0, 0]]])
    trajectory = trajectory_through(np.zeros((4, 2)), people=people, tracks=tracks)
    found = gospa(trajectory, scenario_with(num_people=1))
    squares = np.square([found.localization, found.missed, found.false])
    np.testing.assert_allclose(squares, [0.25 / 3, 0.5 / 3, 0.5 / 3])
    assert found.total**2 == pytest.approx(squares.sum())


def test_where_the_lidar_is_the_source_its_range_bounds_people_and_tracks(trajectory_through, scenario_with):
    people = np.array([[[1.0, 0.0], [11.0, 0.0]]] * 2)
    states = np.array([[0, 7, 1.0, 0.5, 0, 0, 0], [0, 8, 12.0, 0.0, 0, 0, 0]])
    tracks = np.array([[[1.0, 0.5, 0, 0], [np.nan] * 4]])
    trajectory = trajectory_through(np.zeros((2, 2)), people=people, tracks=tracks, track_states=states)
    near, all_of_it = (
        gospa(trajectory, scenario_with(num_people=2, estimation=estimation)).total ** 2
        for estimation in (Estimation(obstacles=ObstacleEstimation(source="lidar")), Estimation())
    )
    assert (near, all_of_it) == (pytest.approx(0.25), pytest.approx(0.25 + 1.0))  # missed at 11 m, false at 12 m


def test_ticks_without_a_belief_and_scenes_without_people_have_none(trajectory_through, scenario_with):
    people = np.zeros((3, 1, 2))
    estimate = np.array([[np.nan] * 3, [0.0] * 3])
    tracks = np.array([[[np.nan] * 4], [[0.0] * 4]])
    trajectory = trajectory_through(np.zeros((3, 2)), people=people, tracks=tracks, estimate=estimate)
    assert gospa(trajectory, scenario_with(num_people=1)).total == 0.0
    blind = trajectory_through(np.zeros((3, 2)), people=people, tracks=tracks, estimate=np.full((2, 3), np.nan))
    assert gospa(blind, scenario_with(num_people=1)) is None
    assert gospa(trajectory_through([[0, 0], [1, 0]]), scenario_with()) is None
