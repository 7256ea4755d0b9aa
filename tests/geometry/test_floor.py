"""Clearances and straight ways between discs and boxes, against points taken densely along them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.geometry.floor import Floor

STEPS = 400
COORDINATE, SIZE = st.floats(-4.0, 4.0), st.floats(0.05, 2.0)
EMPTY = np.zeros((0, 3)), np.zeros((0, 6))


def box(x, y, angle, half_length, half_thickness):
    return (x, y, np.cos(angle), np.sin(angle), half_length, half_thickness)


BOXES = st.builds(box, COORDINATE, COORDINATE, COORDINATE, SIZE, SIZE)
DISCS = st.tuples(COORDINATE, COORDINATE, SIZE)
FLOORS = st.builds(
    lambda discs, boxes: Floor(np.array(discs, float).reshape(-1, 3), np.array(boxes, float).reshape(-1, 6)),
    st.lists(DISCS, max_size=3),
    st.lists(BOXES, max_size=3),
)
POINTS = st.tuples(COORDINATE, COORDINATE)


def test_clearance_is_that_of_the_nearest_surface():
    floor = Floor(np.array([[0.0, 0.0, 1.0]]), np.array([box(5.0, 0.0, 0.5 * np.pi, 2.0, 0.5)]))
    points = [[0.0, 3.0], [0.0, 0.25], [5.0, 3.0], [5.5 + 0.3, 2.4], [5.0, 0.1], [3.0, 0.0]]
    assert floor.clearance(points) == pytest.approx([2.0, -0.75, 1.0, 0.5, -0.5, 1.5])
    assert np.isinf(Floor(*EMPTY).clearance([0.0, 0.0]))


@settings(max_examples=60, deadline=None)
@given(FLOORS, POINTS, POINTS, st.floats(0.05, 1.0))
def test_a_straight_way_is_blocked_where_it_passes_a_body_at_less_than_the_radius(floor, start, end, reach):
    start, end = np.array(start), np.array(end)
    way = start + np.linspace(0.0, 1.0, STEPS + 1)[:, None] * (end - start)
    least = np.inf if not len(floor.discs) + len(floor.boxes) else floor.clearance(way).min()
    step = np.hypot(*(end - start)) / STEPS
    found = floor.blocking(start, end, reach)
    if least < reach - 1e-6:
        assert found is not None
    elif max(least, 0.0) - step > reach:
        assert found is None
