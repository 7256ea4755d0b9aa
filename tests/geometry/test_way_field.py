"""The way left to a goal, against the exact shortest ways and by hand."""

import numpy as np
import pytest

from mjnav.geometry.distance_field import FieldGrid
from mjnav.geometry.floor import Floor, floor_of_map
from mjnav.geometry.shortest_way import WayMap
from mjnav.geometry.way_field import WayField
from mjnav.messages import KnownMap

from .test_floor import EMPTY, box
from .test_shortest_way import length, random_room, room

RADIUS = 0.35
TOO_LONG = 0.25  # [m] that a way around up to three bodies may be too long by, of cells of 0.1 m
TOO_SHORT = 0.01  # [m] by the interpolation between nodes
POINTS = np.random.default_rng(3).uniform(-6.0, 6.0, (500, 2))


def exact_way(ways, start, goal):
    found = ways.way(start, goal)
    return np.inf if found is None else length([start, *found])


def followed(field, start, step=0.05, num=600):
    """The points of a walk of steps along `direction`."""
    way = [np.asarray(start, float)]
    for _ in range(num):
        if np.linalg.norm(way[-1] - (field.grid.goal_x, field.grid.goal_y)) < 2.0 * step:
            break
        way.append(way[-1] + step * field.direction(way[-1][None])[0])
    return np.array(way)


def test_where_nothing_stands_between_it_is_the_straight_way_exactly():
    goal = np.array([1.03, -0.47])
    straight = np.linalg.norm(POINTS - goal, axis=1)
    wall = Floor(EMPTY[0], np.array([box(0.0, -7.0, 0.0, 8.0, 0.1)]))
    for field in (WayField.of(Floor(*EMPTY), goal, RADIUS), WayField.of(wall, goal, RADIUS, POINTS)):
        assert field.way_left(POINTS) == pytest.approx(straight, abs=1e-12)
        assert field.direction(POINTS) == pytest.approx((goal - POINTS) / straight[:, None], abs=1e-9)
        assert field.way_left([goal])[0] == 0.0
        assert (field.direction([goal]) == 0.0).all()


@pytest.mark.parametrize("seed", range(8))
def test_in_random_rooms_it_is_as_long_as_the_exact_shortest_way_and_going_along_it_takes_no_longer(seed):
    rng = np.random.default_rng(seed)
    floor = random_room(rng)
    points = rng.uniform(-2.9, 2.9, (60, 2))
    points = points[floor.clearance(points) >= RADIUS + 0.01]
    goal, starts = points[0], points[1:]
    field, ways = WayField.of(floor, goal, RADIUS), WayMap(floor, RADIUS, 1e-3)
    shortest = np.array([exact_way(ways, start, goal) for start in starts])
    narrower = WayMap(floor, RADIUS - field.grid.cell, 1e-3)  # a gap that is up to two cells too narrow may count
    least = np.array([exact_way(narrower, start, goal) for start in starts])
    reached, found = np.isfinite(shortest), field.way_left(starts)
    tight = np.array([exact_way(WayMap(floor, RADIUS + field.grid.cell, 1e-2), start, goal) for start in starts])
    assert (found[reached] >= np.minimum(shortest, least)[reached] - TOO_SHORT).all()
    wide = np.isfinite(tight)
    assert (found[wide] <= tight[wide] + TOO_LONG).all()
    same = reached & (tight < shortest + 0.5)  # no gap on the way is so narrow that the grid may miss it
    assert np.abs(found - shortest)[same & (shortest < least + 0.5)].max(initial=0.0) <= TOO_LONG
    for start in starts[same][:5]:
        way = followed(field, start)
        assert np.linalg.norm(way[-1] - goal) < 0.1
        assert length(way) <= field.way_left([start])[0] + 0.1
        assert floor.clearance(way).min() >= RADIUS - field.grid.cell


def test_it_falls_along_the_direction_everywhere_and_is_finite_in_bodies_too():
    floor = random_room(np.random.default_rng(4))
    assert (floor.clearance(POINTS) < 0.0).any()
    goal = np.array([2.4, 2.3])
    field = WayField.of(floor, goal, RADIUS)
    left, ahead = field.way_left(POINTS), field.direction(POINTS)
    assert np.isfinite(left).all()
    assert (left >= np.linalg.norm(POINTS - goal, axis=1) - 1e-12).all()
    assert np.linalg.norm(ahead, axis=1) == pytest.approx(1.0)
    assert (field.way_left(POINTS + 1e-6 * ahead) < left).all()


def test_from_a_place_without_room_the_way_leads_out_of_the_body_first():
    floor = room([(0.0, 0.0, 0.5 * np.pi, 1.5, 0.05)], [])
    field = WayField.of(floor, [2.0, 0.0], RADIUS)
    x = np.array([0.35, 0.25, 0.2])  # from the middle of the wall, where 0.4 is free
    right, left = np.column_stack([x, [0.0] * 3]), np.column_stack([-x, [0.3] * 3])
    assert (field.direction(right)[:, 0] > 0.7).all()
    assert (field.direction(left)[:, 0] < -0.3).all()
    assert field.way_left(right) == pytest.approx(1.6 + 2.0 * (0.4 - x), abs=0.15)


def test_a_closed_room_a_goal_in_a_wall_and_a_floor_without_any_room_have_finite_ways():
    inside, outside = [0.0, 0.0], [[4.5, 0.3], [-5.0, 5.0]]
    through = WayField.of(room([], []), inside, RADIUS, outside).way_left(outside)
    assert np.isfinite(through).all()
    assert (through > 20.0).all()
    in_wall = WayField.of(room([], []), [3.0, 0.2], RADIUS)
    near = in_wall.way_left([[2.6, 0.2], [2.0, 0.2], [0.0, 0.2]])
    assert near == pytest.approx([0.4, 1.0, 3.0], abs=0.1)
    filled = WayField.of(Floor(np.array([[0.0, 0.0, 3.0]]), EMPTY[1]), [0.5, 0.0], RADIUS)
    assert np.isfinite(filled.way_left(POINTS)).all()


def test_a_gap_of_the_discs_width_is_open_wherever_it_lies_and_one_that_is_two_cells_narrower_is_closed():
    for at in np.linspace(-0.05, 0.05, 11):
        for gap, passes in ((2.0 * RADIUS, True), (2.0 * RADIUS - 0.2, False)):
            half = 0.5 * (1.5 - 0.5 * gap)
            ends = [(at + s * (0.5 * gap + half), half) for s in (-1, 1)]
            boxes = [box(0.013, middle, 0.5 * np.pi, size, 0.05) for middle, size in ends]
            sides = [box(0.0, at + s * 1.55, 0.0, 2.0, 0.05) for s in (-1, 1)]
            backs = [box(s * 2.0, at, 0.5 * np.pi, 1.5, 0.05) for s in (-1, 1)]
            field = WayField.of(Floor(EMPTY[0], np.array([*boxes, *sides, *backs])), [1.0, at - 0.8], RADIUS)
            assert (float(field.way_left([[-1.0, at - 0.8]])[0]) < 4.0) is passes


def test_the_floor_of_a_map_is_where_its_walls_and_discs_are():
    walls = np.array([[[0.0, 0.0], [4.0, 0.0]], [[1.0, 1.0], [1.0, 3.0]]])
    floor = floor_of_map(KnownMap(walls, np.array([0.2, 0.4]), np.array([[5.0, 5.0, 0.5]])))
    points = [[2.0, 0.6], [4.5, 0.0], [2.2, 2.0], [5.0, 6.0]]
    assert floor.clearance(points) == pytest.approx([0.5, 0.5, 1.0, 0.5])
    assert len(floor_of_map(KnownMap(np.zeros((0, 2, 2)), np.zeros(0), np.zeros((0, 3)))).boxes) == 0


@pytest.mark.parametrize(("high", "expected"), [(20.0, 4.0 + 3.0), (1.0, 2.0 * np.hypot(2.0, 1.0) + 1.0)])
def test_over_floor_that_was_not_seen_a_way_costs_a_multiple_of_its_length_and_goes_round_where_that_is_less(
    high, expected
):
    """A strip from x = 2 to 3, which ends at y = 1 or goes on; its cells are half as wide as the field's."""
    x, y = np.meshgrid(np.arange(-3.0, 9.0, 0.05), np.arange(-6.0, 6.0, 0.05))
    unseen = FieldGrid(((x > 2.0) & (x < 3.0) & (np.abs(y) < high)).astype(float), -3.0, -6.0, 0.05)
    posts = Floor(np.array([[-2.0, -5.0, 0.1], [8.0, 5.0, 0.1]]), EMPTY[1])
    field = WayField.of(posts, (5.0, 0.0), RADIUS, [[0.0, 0.0]], unseen=unseen, factor=3.0)
    assert field.way_left([[0.0, 0.0]])[0] == pytest.approx(expected, abs=0.2)
    assert field.way_left([[6.0, 0.0]])[0] == 1.0, "behind it nothing changes"
