"""The distance field of a floor, against the exact clearance and against scipy's distance transform of a picture."""

import numpy as np
import pytest
from hypothesis import given, settings

from mjnav.geometry.distance_field import MAX_CELLS, DistanceField
from mjnav.geometry.floor import Floor

from .test_floor import EMPTY, FLOORS, box

ROOM = Floor(
    np.array([[1.0, 0.5, 0.03], [2.0, -1.0, 0.2]]),
    np.array([box(0.0, -2.0, 0.0, 4.0, 0.05), box(4.0, 0.3, 0.5 * np.pi, 2.3, 0.05), box(-1.0, 1.0, 0.7, 0.8, 0.1)]),
)
POINTS = np.random.default_rng(5).uniform([-5.0, -3.0], [5.0, 3.0], (4000, 2))


def test_it_is_the_exact_clearance_at_the_nodes_and_within_a_cell_of_it_between_them():
    field = DistanceField.of(ROOM)
    grid = field.grid
    rows, columns = grid.clearance.shape
    nodes = np.stack(
        np.meshgrid(grid.x + grid.cell * np.arange(columns), grid.y + grid.cell * np.arange(rows)), axis=-1
    )
    assert field.clearance(nodes.reshape(-1, 2)) == pytest.approx(ROOM.clearance(nodes).ravel(), abs=1e-12)
    error = np.abs(field.clearance(POINTS) - ROOM.clearance(POINTS))
    assert error.max() < grid.cell
    assert np.median(error) < 1e-3


def test_beside_a_straight_face_it_is_exact_on_both_sides():
    field = DistanceField.of(Floor(EMPTY[0], np.array([box(0.013, 0.0, 0.0, 3.0, 0.2)])))
    y = np.linspace(0.02, 0.9, 200)
    points = np.column_stack([np.linspace(-2.0, 2.0, 200), y])
    away = np.abs(y - 0.0) > 0.06  # the middle of the wall bends
    assert field.clearance(points)[away] == pytest.approx((y - 0.2)[away], abs=1e-12)
    assert field.gradient(points)[away] == pytest.approx(np.tile([0.0, 1.0], (away.sum(), 1)), abs=1e-9)


def test_the_gradient_is_the_derivative_of_the_interpolation():
    field, step = DistanceField.of(ROOM), 1e-7
    grid = field.grid
    place = (POINTS - [grid.x, grid.y]) / grid.cell % 1.0
    points = POINTS[((place > 0.01) & (place < 0.99)).all(axis=1)]  # it jumps where one cell ends
    for axis, shift in enumerate(np.eye(2) * step):
        slope = (field.clearance(points + shift) - field.clearance(points - shift)) / (2.0 * step)
        assert field.gradient(points)[:, axis] == pytest.approx(slope, abs=1e-6)


@settings(max_examples=30, deadline=None)
@given(FLOORS)
def test_beyond_the_grid_it_is_no_less_than_the_clearance_and_more_by_no_more_than_the_way_around(floor):
    field = DistanceField.of(floor, 0.1)
    points = 30.0 * np.array([[1.0, 0.2], [-1.0, 1.0], [0.1, -1.0]])
    exact = floor.clearance(points)
    if not len(floor.discs) + len(floor.boxes):
        assert (field.clearance(points) == np.inf).all()
        assert (field.gradient(points) == 0.0).all()
        return
    assert (field.clearance(points) >= exact - 0.1).all()
    assert (field.clearance(points) <= exact + 12.0).all()
    assert np.linalg.norm(field.gradient(points), axis=1) == pytest.approx(1.0)


def test_a_large_floor_has_larger_cells_and_what_is_no_point_has_no_distance():
    far = Floor(np.array([[0.0, 0.0, 0.1], [500.0, 10.0, 0.1]]), EMPTY[1])
    field = DistanceField.of(far)
    assert max(field.grid.clearance.shape) <= MAX_CELLS
    assert field.clearance([[250.0, 5.0]]) == pytest.approx(far.clearance([[250.0, 5.0]]), abs=field.grid.cell)
    assert np.isnan(field.clearance([[np.nan, 0.0]])).all()
