import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.geometry.distances import segment_distance

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


@pytest.mark.parametrize(
    ("point", "expected"), [((1.0, 2.0), 2.0), ((-3.0, 4.0), 5.0), ((5.0, 4.0), 5.0), ((0.5, 0.0), 0.0)]
)
def test_a_point_is_nearest_to_the_inside_or_to_an_end(point, expected):
    assert float(segment_distance(point, (0.0, 0.0), (2.0, 0.0))) == pytest.approx(expected, abs=1e-15)


def test_a_segment_without_length_is_a_point():
    assert float(segment_distance((3.0, 4.0), (0.0, 0.0), (0.0, 0.0))) == 5.0
    assert float(segment_distance((3.0, 4.0), (0.0, 0.0), (1e-200, 0.0))) == 5.0


def test_points_and_segments_broadcast():
    points = np.array([[[0.0, 1.0]], [[1.0, -2.0]]])  # (2, 1, 2)
    start, end = np.array([[-9.0, 0.0], [5.0, -9.0], [0.0, 0.0]]), np.array([[9.0, 0.0], [5.0, 9.0], [0.0, 0.0]])
    assert segment_distance(points, start, end).tolist() == [[1.0, 5.0, 1.0], [2.0, 4.0, pytest.approx(5.0**0.5)]]
