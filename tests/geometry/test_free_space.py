"""Where a disc fits, and by which way it goes: against exact distances, and cases that can be done by hand."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.geometry.free_space import FreeSpace

# A wall along y at x = 2 from y = -5 to 5 with a gap around y = 0, and a pillar behind the gap.
LOWER, UPPER = (2.0, -2.75, 0.0, 1.0, 2.25, 0.05), (2.0, 2.75, 0.0, 1.0, 2.25, 0.05)
PILLAR = (3.5, 0.0, 0.3)


def gap(width: float) -> FreeSpace:
    boxes = [(2.0, s * (2.5 + 0.25 * width), 0.0, 1.0, 2.5 - 0.25 * width, 0.05) for s in (-1, 1)]
    room = [(2.0, y, 1.0, 0.0, 4.0, 0.05) for y in (-5, 5)] + [(x, 0.0, 0.0, 1.0, 5.0, 0.05) for x in (-2, 6)]
    return FreeSpace.of([], [*boxes, *room], [])


@pytest.mark.parametrize(("width", "passes"), [(1.0, True), (0.55, True), (0.39, False)])
def test_a_disc_of_a_fifth_passes_a_gap_that_is_wider_than_its_diameter_and_two_cells(width, passes):
    space = gap(width)
    assert space.connects([[0, 0], [4, 0]], 0.2) == passes
    assert (space.way((0, 0), (4, 0), 0.2) is not None) == passes


def test_in_open_space_the_way_is_the_straight_line():
    way = FreeSpace.of([PILLAR], [], [[0, 2], [6, 3]]).way((0, 2), (6, 3), 0.3)
    assert way is not None
    np.testing.assert_allclose(way, [[0, 2], [6, 3]])


def test_the_way_round_a_pillar_is_hardly_longer_than_the_tangents_and_the_arc():
    radius = 0.3 + 0.25
    way = FreeSpace.of([(0, 0, 0.3)], [], [[-3, 0], [3, 0]]).way((-3, 0), (3, 0), 0.25)
    assert way is not None
    shortest = 2 * (np.sqrt(9 - radius**2) + radius * np.arcsin(radius / 3))
    assert shortest <= np.linalg.norm(np.diff(way, axis=0), axis=1).sum() < 1.03 * shortest


bodies = st.lists(st.tuples(st.floats(0, 6), st.floats(-2, 2), st.floats(0.05, 0.6)), max_size=6)
walls = st.lists(st.tuples(st.floats(0, 6), st.floats(-2, 2), st.floats(0, 3.2), st.floats(0.2, 1.5)), max_size=4)


@settings(max_examples=25, deadline=None)
@given(bodies, walls)
def test_no_way_comes_nearer_to_a_surface_than_the_disc_is_wide(discs, sides):
    boxes = [(x, y, np.cos(yaw), np.sin(yaw), half, 0.05) for x, y, yaw, half in sides]
    start, goal, radius = (-1.5, 0.0), (7.5, 0.0), 0.22
    space = FreeSpace.of(discs, boxes, [start, goal])
    way = space.way(start, goal, radius)
    assert (way is not None) == space.connects([start, goal], radius)
    if way is not None and space.distance([start, goal]).min() > radius:
        legs = pairwise(way)
        along = np.concatenate([a + (b - a) * np.linspace(0, 1, 200)[:, None] for a, b in legs])
        assert space.distance(along).min() > radius - 1e-6


def test_the_grid_has_the_clearance_of_its_cells():
    space = FreeSpace.of([PILLAR], [LOWER, UPPER], [[0, 0]], reach=0.8)
    rows, columns = np.indices(space.clearance.shape)
    centres = np.stack([space.low[0] + space.cell * columns, space.low[1] + space.cell * rows], axis=-1)
    np.testing.assert_allclose(space.clearance, np.minimum(space.distance(centres), 0.8), atol=1e-12)
