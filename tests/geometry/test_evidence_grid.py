"""What beams say of cells, against a literal reference and by hand."""

import numpy as np
import pytest

from mjnav.geometry.evidence_grid import (
    CELL,
    FREE,
    HIT,
    LEAST,
    MOST,
    OCCUPIED,
    PASS,
    EvidenceGrid,
    add_scan,
    field_of,
    seen_free,
    stand,
)

SURE = np.zeros(6)  # the covariance of a frame that is known


def cells_passed(origin, end, grid):
    """The cells that a beam passes, all but the last half metre of a cell: sampled as finely as the kernel does."""
    length = np.linalg.norm(end - origin)
    ways = 0.5 * CELL * np.arange(int((length - CELL) / (0.5 * CELL)))
    places = origin + ways[:, None] / length * (end - origin)
    return {tuple(cell) for cell in np.floor((places - [grid.x, grid.y]) / CELL).astype(int)}


def test_scans_add_up_as_the_book_has_it():
    rng = np.random.default_rng(5)
    grid, origin, odds = EvidenceGrid.around(0.3, -0.2, 2.0), np.array([0.31, -0.17]), {}
    for _ in range(12):
        angles, ranges = rng.uniform(-np.pi, np.pi, 40), rng.uniform(0.2, 1.6, 40)
        ends, met = origin + ranges[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]), rng.random(40) < 0.7
        add_scan(grid, np.tile(origin, (40, 1)), ends, met, SURE)
        hit = {tuple(cell) for cell in np.floor((ends[met] - [grid.x, grid.y]) / CELL).astype(int)}
        passed = set().union(*(cells_passed(origin, end, grid) for end in ends)) - hit
        odds |= {cell: min(odds.get(cell, 0.0) + HIT, MOST) for cell in hit}
        odds |= {cell: max(odds.get(cell, 0.0) - PASS, LEAST) for cell in passed}
    expected = np.zeros_like(grid.odds)
    for (i, j), value in odds.items():
        expected[j, i] = value
    np.testing.assert_allclose(grid.odds, expected, atol=1e-12)


def test_a_surface_is_known_better_than_a_cell():
    rng = np.random.default_rng(6)
    grid = EvidenceGrid.around(0.0, 0.0, 2.0)
    place = np.array([1.012, 0.013])
    for _ in range(30):
        end = place + rng.normal(0.0, 0.003, (1, 2))
        add_scan(grid, np.zeros((1, 2)), end, np.array([True]), SURE)
    (found,) = grid.surfaces()
    assert found == pytest.approx(place, abs=0.004)
    assert grid.odds.max() == MOST > OCCUPIED


def test_a_cell_has_the_mean_covariance_of_the_frames_of_its_beams():
    rng = np.random.default_rng(9)
    grid, end, frames = EvidenceGrid.around(0.0, 0.0, 2.0), np.array([[1.012, 0.013]]), rng.uniform(0.0, 1.0, (7, 6))
    for frame in frames:
        add_scan(grid, np.zeros((1, 2)), end, np.array([True]), frame)
    ((row, column),) = np.argwhere(grid.counts)
    np.testing.assert_allclose(grid.frames[row, column], frames.mean(axis=0), rtol=1e-12)
    moved = grid.moved(3, -2)
    np.testing.assert_array_equal(moved.frames[row + 2, column - 3], grid.frames[row, column])


def test_what_has_gone_is_forgotten_after_beams_have_passed():
    grid, origin, end = EvidenceGrid.around(0.0, 0.0, 2.0), np.zeros((1, 2)), np.array([[1.0, 0.0]])
    for _ in range(10):
        add_scan(grid, origin, end, np.array([True]), SURE)
    assert len(grid.surfaces()) == 1
    for _ in range(int(np.ceil((MOST - OCCUPIED) / PASS))):
        add_scan(grid, origin, 1.8 * end, np.array([False]), SURE)
    assert len(grid.surfaces()) == 0


def test_a_window_that_moves_keeps_what_stays_within():
    rng = np.random.default_rng(7)
    grid = EvidenceGrid.around(0.0, 0.0, 1.0)
    ends = rng.uniform(-1.0, 1.0, (60, 2))
    for _ in range(3):
        add_scan(grid, ends - 1e-3, ends, np.ones(60, bool), SURE)
    before, moved = grid.surfaces(), grid.moved(7, -4)
    inside = ((before >= [moved.x, moved.y]) & (before < np.array([moved.x, moved.y]) + CELL * len(moved.odds))).all(1)
    assert 0 < inside.sum() < len(before)
    assert {tuple(p) for p in moved.surfaces()} == {tuple(p) for p in before[inside]}
    assert moved.middle == pytest.approx(grid.middle + np.array([7, -4]) * CELL)


def test_distances_are_those_to_the_nearest_point_up_to_the_reach():
    rng = np.random.default_rng(8)
    points = rng.uniform(-0.2, 2.2, (30, 2))
    field = field_of(points, np.zeros(2), 2.0, 0.025, 0.3)
    y, x = 0.025 * np.mgrid[: len(field.clearance), : len(field.clearance)]
    away = np.hypot(x[..., None] - points[:, 0], y[..., None] - points[:, 1]).min(axis=-1)
    np.testing.assert_allclose(field.clearance, np.minimum(away, 0.3), atol=1e-12)


def test_a_disc_gets_as_far_as_the_floor_was_seen_free():
    grid = EvidenceGrid.around(0.0, 0.0, 4.0)
    grid.odds[:] = LEAST
    beyond = int((2.0 - grid.x) / CELL)
    grid.odds[:, beyond:] = 0.0  # from x = 2 m on nothing is known
    straight = seen_free(grid, np.zeros(3), 1.0, 0.0, 0.2, 3.0)
    assert straight == pytest.approx(1.8, abs=1.5 * CELL)
    assert seen_free(grid, np.zeros(3), 1.0, 0.0, 0.2, 1.0) == 1.0
    assert seen_free(grid, np.zeros(3), 1.0, 1.0, 0.2, 3.0) == 3.0  # a circle of 1 m to the left: at most x = 1 m
    assert seen_free(grid, np.array([0.0, 0.0, np.pi]), -1.0, 0.0, 0.2, 3.0) == pytest.approx(straight, abs=CELL)
    assert FREE > LEAST


def test_where_a_body_stands_nothing_else_is():
    grid = EvidenceGrid.around(0.0, 0.0, 1.0)
    grid.odds[:] = MOST
    stand(grid, 0.1, 0.0, 0.3)
    y, x = np.mgrid[: len(grid.odds), : len(grid.odds)]
    away = np.hypot(grid.x + (x + 0.5) * CELL - 0.1, grid.y + (y + 0.5) * CELL)
    assert (grid.odds[away < 0.3 - CELL] == LEAST).all()
    assert (grid.odds[away > 0.3 + CELL] == MOST).all()
