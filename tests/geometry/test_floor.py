"""Clearances and straight ways between discs and boxes, against points taken densely along them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.geometry.floor import CELL, Floor, FreeSpace
from mjnav.geometry.shortest_way import WayMap

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


RADIUS = 0.22


def room(boxes, discs) -> Floor:
    """A closed room of 8 x 6 m around (0, 0) with these bodies in it."""
    walls = [(0, s * 3, 1, 0, 4, 0.05) for s in (-1, 1)] + [(s * 4, 0, 0, 1, 3, 0.05) for s in (-1, 1)]
    return Floor(np.array(discs, float).reshape(-1, 3), np.array([*walls, *boxes], float))


@pytest.mark.parametrize(("gap", "cut_off"), [(2 * RADIUS, None), (2 * RADIUS - 3 * CELL, 1)])
def test_a_place_is_cut_off_only_where_the_disc_surely_does_not_pass(gap, cut_off):
    half = 0.5 * (3 - 0.5 * gap)
    space = FreeSpace.of(room([(0.0, s * (0.5 * gap + half), 0, 1, half, 0.05) for s in (-1, 1)], []), [[0, 0]])
    assert space.first_cut_off([[-2, 1], [2, 1]], RADIUS) == cut_off
    assert space.first_cut_off([[-2, 1], [0.3, 1]], RADIUS, tolerance=0.2) == cut_off
    assert space.first_cut_off([[-2, 1], [0.3, 1]], RADIUS, tolerance=0.9) is None  # as near from this side


@pytest.mark.parametrize("seed", range(12))
def test_where_the_grid_sees_a_way_there_is_one_and_where_a_wider_disc_has_one_it_sees_it(seed):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, np.pi, 5)
    boxes = np.column_stack([rng.uniform(-3, 3, (5, 2)), np.cos(angle), np.sin(angle), rng.uniform(0.2, 1.6, (5, 1))])
    floor = room(np.column_stack([boxes, np.full(5, 0.05)]), [(*rng.uniform(-2.5, 2.5, 2), 0.3) for _ in range(4)])
    ends = np.array([[-3.5, -2.5], [3.5, 2.5]])
    if (floor.clearance(ends) < RADIUS + 2 * CELL).any():
        ends = ends * [1, -1]
    space = FreeSpace.of(floor, ends)
    sees = space.connects(ends, RADIUS)
    exact, wider = (WayMap(floor, reach).way(*ends) is not None for reach in (RADIUS, RADIUS + 2 * CELL))
    assert wider <= sees <= exact <= (space.first_cut_off(ends, RADIUS) is None)
