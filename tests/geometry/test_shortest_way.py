"""Shortest ways: by hand, against the shortest way on a fine grid, and clear of every body."""

from itertools import pairwise
from math import acos, atan2, hypot, pi, sqrt

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from mjnav.geometry.floor import Floor
from mjnav.geometry.shortest_way import EXCESS, WayMap

NONE = np.zeros((0, 3))
REACH = 0.35
SIDE, STEP = 6.0, 0.1  # [m] of the square room, and between the grid's points
AXIS = np.arange(-0.5 * SIDE, 0.5 * SIDE, STEP)
DIAGONAL = 1.0 / np.cos(pi / 8)  # how much longer than straight a way in eight directions is at most


def length(points):
    """Of a polyline (k, 2) [m]."""
    return float(np.linalg.norm(np.diff(np.asarray(points, float), axis=0), axis=1).sum())


def around_a_box(half_length, half_thickness, away, reach):
    """From (-away, 0) to (away, 0) around a box at the origin: two tangents, two arcs and the straight side."""
    dx, dy = away - half_length, half_thickness
    tangent = sqrt(dx * dx + dy * dy - reach * reach)
    turn = atan2(dy, dx) + np.arcsin(reach / hypot(dx, dy))
    return 2.0 * (tangent + reach * turn + half_length)


def around_a_disc(radius, away):
    return 2.0 * (sqrt(away * away - radius * radius) + radius * (0.5 * pi - acos(radius / away)))


CASES = {
    "around a box": (Floor(NONE, np.array([[0, 0, 1, 0, 1.0, 2.0]])), around_a_box(1.0, 2.0, 5.0, REACH)),
    "around a disc": (Floor(np.array([[0, 0, 1.0]]), np.zeros((0, 6))), around_a_disc(1.0 + REACH, 5.0)),
    "nothing between": (Floor(NONE, np.array([[0, 3, 1, 0, 1.0, 2.0]])), 10.0),
}


@pytest.mark.parametrize("case", CASES)
def test_a_way_has_the_length_that_is_computed_by_hand(case):
    floor, expected = CASES[case]
    for excess, slack in ((EXCESS, 2.0 * EXCESS), (1e-4, 3e-4)):
        found = WayMap(floor, REACH, excess).way([-5.0, 0.0], [5.0, 0.0])
        assert found is not None
        assert expected - 1e-9 <= length([[-5.0, 0.0], *found]) <= expected + slack


def room(boxes, discs):
    """A closed square room with these bodies in it."""
    half = 0.5 * SIDE
    walls = [(0, s * half, 1, 0, half, 0.05) for s in (-1, 1)] + [(s * half, 0, 0, 1, half, 0.05) for s in (-1, 1)]
    boxes = [(x, y, np.cos(a), np.sin(a), u, v) for x, y, a, u, v in boxes]
    return Floor(np.array(discs, float).reshape(-1, 3), np.array([*walls, *boxes], float))


def random_room(rng):
    boxes = np.column_stack(
        [rng.uniform(-2.4, 2.4, (3, 2)), rng.uniform(0.0, pi, 3), rng.uniform(0.2, 1.6, 3), rng.uniform(0.05, 0.3, 3)]
    )
    return room(boxes, np.column_stack([rng.uniform(-2.4, 2.4, (3, 2)), rng.uniform(0.05, 0.5, 3)]))


def on_a_grid(floor, start, goal, reach):
    """The length of the shortest way over neighbouring grid points that are free, eight to a point."""
    points = np.stack(np.meshgrid(AXIS, AXIS, indexing="ij"), axis=-1)
    free = floor.clearance(points) >= reach
    number = np.arange(free.size).reshape(free.shape)
    rows, columns, weights = [], [], []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
        a = (slice(0, len(AXIS) - dx), slice(max(0, -dy), len(AXIS) - max(0, dy)))
        b = (slice(dx, len(AXIS)), slice(max(0, dy), len(AXIS) - max(0, -dy)))
        both = free[a] & free[b]
        rows.append(number[a][both])
        columns.append(number[b][both])
        weights.append(np.full(both.sum(), STEP * hypot(dx, dy)))
    rows, columns, weights = map(np.concatenate, (rows, columns, weights))
    graph = csr_array((weights, (rows, columns)), shape=(free.size, free.size))
    at = [number[tuple(np.rint((np.asarray(p) - AXIS[0]) / STEP).astype(int))] for p in (start, goal)]
    return float(dijkstra(graph, directed=False, indices=at[0])[at[1]])


@pytest.mark.parametrize("seed", range(40))
def test_a_way_is_clear_of_all_bodies_and_as_short_as_the_shortest_on_a_fine_grid(seed):
    rng = np.random.default_rng(seed)
    floor = random_room(rng)
    points = np.stack(np.meshgrid(AXIS, AXIS), axis=-1).reshape(-1, 2)
    wide = REACH + STEP  # whoever has a way of this width has grid points beside it
    free = points[floor.clearance(points) >= wide]
    start, goal = (rng.choice(free[np.argsort(free[:, 0])][part]) for part in (slice(50), slice(-50, None)))
    found = WayMap(floor, REACH).way(start, goal)
    expected = on_a_grid(floor, start, goal, REACH)
    if found is None:
        assert np.isinf(on_a_grid(floor, start, goal, REACH + EXCESS))
        return
    way = np.array([start, *found])
    assert np.array_equal(way[-1], goal)
    dense = np.concatenate([a + np.linspace(0, 1, 200)[:, None] * (b - a) for a, b in pairwise(way)])
    assert floor.clearance(dense).min() >= REACH - 1e-6
    corners = len(way) - 2
    # A line between two grid points may pass a corner nearer than both of them do, by less than STEP^2 / (4 REACH).
    assert length(way) <= expected + 1e-9 + 2.0 * corners * (EXCESS + STEP * STEP / REACH)
    wider = WayMap(floor, wide).way(start, goal)
    if wider is not None:
        assert expected <= DIAGONAL * length([start, *wider]) + 4.0 * STEP


def test_there_is_no_way_out_of_a_closed_room_and_none_through_a_gap_that_is_too_narrow():
    assert WayMap(room([], []), REACH).way([0.0, 0.0], [9.0, 0.0]) is None
    for gap, passes in ((2.0 * REACH + 0.001, True), (2.0 * REACH - 0.001, False)):
        half = 0.5 * (0.5 * SIDE - 0.5 * gap)
        doorway = [(0.0, s * (0.5 * gap + half), 0.5 * pi, half, 0.05) for s in (-1, 1)]
        found = WayMap(room(doorway, []), REACH).way([-2.0, 1.0], [2.0, 1.0])
        assert (found is not None) is passes
