from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.geometry.distances import ellipse_95, nearest_pairs, segment_distance

POINT = arrays(float, 2, elements=st.floats(-5.0, 5.0))


def brute_force(point, start, end):
    s = np.linspace(0.0, 1.0, 2001)[:, None]
    return np.hypot(*(start + s * (end - start) - point).T).min()


@given(POINT, POINT, POINT)
def test_the_distance_is_that_of_the_nearest_of_many_points_of_the_segment(point, start, end):
    exact = float(segment_distance(point, start, end))
    sampled = brute_force(point, start, end)
    spacing = np.hypot(*(end - start)) / 2000
    assert exact <= sampled + 1e-12
    assert exact >= sampled - spacing - 1e-12


def test_points_and_segments_broadcast():
    points = np.array([[[0.0, 1.0]], [[1.0, -2.0]]])  # (2, 1, 2)
    start, end = np.array([[-9.0, 0.0], [5.0, -9.0], [0.0, 0.0]]), np.array([[9.0, 0.0], [5.0, 9.0], [0.0, 0.0]])
    assert segment_distance(points, start, end).tolist() == [[1.0, 5.0, 1.0], [2.0, 4.0, pytest.approx(5.0**0.5)]]


POINTS = st.lists(st.tuples(*[st.floats(-2.0, 2.0)] * 2), max_size=4).map(lambda found: np.reshape(found, (-1, 2)))


@settings(max_examples=60, deadline=None)
@given(POINTS, POINTS)
def test_pairs_cost_as_little_as_the_best_of_all_assignments(first, second):
    gate = 1.0
    pairs = nearest_pairs(first, second, gate)

    def cost(pairs):
        return sum(np.linalg.norm(first[i] - second[j]) for i, j in pairs) + gate * (len(first) - len(pairs))

    padded = [*range(len(second)), *[None] * len(first)]
    every = (
        [(i, j) for i, j in enumerate(chosen) if j is not None and np.linalg.norm(first[i] - second[j]) <= gate]
        for chosen in set(permutations(padded, len(first)))
    )
    assert abs(cost(pairs) - min(map(cost, every))) < 1e-9
    assert len({j for _, j in pairs}) == len(pairs)


def test_who_is_not_there_and_who_is_too_far_is_left_out():
    people = [[np.nan, np.nan], [0.0, 0.0], [5.0, 5.0]]
    assert nearest_pairs(people, [[4.8, 5.0], [0.0, 1.1]], 1.0) == [(2, 0)]
    assert nearest_pairs(people, np.zeros((0, 2)), 1.0) == []


def test_the_axes_of_a_turned_gaussian_are_found():
    turn = 0.7
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    covariance = rotation @ np.diag([0.09, 0.01]) @ rotation.T
    assert ellipse_95(covariance) == pytest.approx((0.3 * np.sqrt(5.991), 0.1 * np.sqrt(5.991), turn))
    larger = np.zeros((4, 4))
    larger[:2, :2] = covariance
    assert ellipse_95(larger) == ellipse_95(covariance)
