"""Which places are connected: by hand, and against shortest ways, which are exact."""

import numpy as np
import pytest

from mjnav.geometry.floor import CELL, Floor, FreeSpace
from mjnav.geometry.shortest_way import WayMap

RADIUS = 0.22


def room(boxes, discs) -> Floor:
    """A closed room of 8 x 6 m around (0, 0) with these bodies in it."""
    walls = [(0, s * 3, 1, 0, 4, 0.05) for s in (-1, 1)] + [(s * 4, 0, 0, 1, 3, 0.05) for s in (-1, 1)]
    return Floor(np.array(discs, float).reshape(-1, 3), np.array([*walls, *boxes], float))


@pytest.mark.parametrize(("gap", "passes"), [(2 * RADIUS + 2 * CELL, True), (2 * RADIUS - 0.001, False)])
def test_a_disc_passes_a_doorway_that_is_two_cells_wider_than_itself_and_none_narrower_than_itself(gap, passes):
    half = 0.5 * (3 - 0.5 * gap)
    space = FreeSpace.of(room([(0.0, s * (0.5 * gap + half), 0, 1, half, 0.05) for s in (-1, 1)], []), [[0, 0]])
    assert space.connects([[-2, 1], [2, 1]], RADIUS) is passes
    assert space.part_of([[-2, 1], [9, 9]], RADIUS)[1] == 0
    assert not passes or space.first_cut_off([[-2, 1], [2, 1]], RADIUS) is None


@pytest.mark.parametrize(("gap", "cut_off"), [(2 * RADIUS, None), (2 * RADIUS - 3 * CELL, 1)])
def test_a_place_is_cut_off_only_where_the_disc_surely_does_not_pass(gap, cut_off):
    half = 0.5 * (3 - 0.5 * gap)
    space = FreeSpace.of(room([(0.0, s * (0.5 * gap + half), 0, 1, half, 0.05) for s in (-1, 1)], []), [[0, 0]])
    assert space.first_cut_off([[-2, 1], [2, 1]], RADIUS) == cut_off
    assert space.first_cut_off([[-2, 1], [0.3, 1]], RADIUS, tolerance=0.2) == cut_off
    assert space.first_cut_off([[-2, 1], [0.3, 1]], RADIUS, tolerance=0.9) is None  # as near from this side


def test_a_point_beside_a_wall_counts_where_the_disc_can_come_as_near_as_the_tolerance():
    space = FreeSpace.of(room([], []), [[0, 0]])
    assert not space.connects([[0, 0], [3.85, 0]], RADIUS)
    assert space.connects([[0, 0], [3.85, 0]], RADIUS, tolerance=0.3)


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
