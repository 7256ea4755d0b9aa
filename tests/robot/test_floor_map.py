"""The map that controllers get."""

import numpy as np
import pytest

from mjnav.robot.seen_space import FloorMap


def test_legs_and_pillars_are_discs_at_rest_under_their_bodies_names(room):
    scenario = room()
    floor_map = FloorMap(scenario)
    assert floor_map.names == ("table0",) * 4 + ("pillar0",)
    assert [disc.radius for disc in floor_map.discs] == [0.03] * 4 + [scenario.pillars[0].radius]
    assert all(disc.position.shape == (1, 2) and not disc.velocity.any() for disc in floor_map.discs)
    legs = sorted(tuple(disc.position[0].round(9).tolist()) for disc in floor_map.discs[:4])
    assert legs == [(3.2, 0.6), (3.2, 1.4), (4.8, 0.6), (4.8, 1.4)]
    assert floor_map.discs[4].position.tolist() == [[3.0, -1.0]]


@pytest.mark.parametrize(("y", "face"), [(0.0, -1.8), (-5.0, -2.2)])
def test_a_wall_is_its_face_towards_the_robot_longer_by_half_its_thickness(room, y, face):
    floor_map = FloorMap(room("walls.0.thickness=0.4"))
    (wall,) = floor_map.walls(np.array([1.0, y]))
    assert wall == pytest.approx(np.array([[-1.2, face], [8.2, face]]))


def test_the_face_is_right_for_any_direction_in_which_a_wall_was_drawn(room):
    there, back = (
        room("walls.0.thickness=0.4"),
        room("walls.0.from=[8.0, -2.0]", "walls.0.to=[-1.0, -2.0]", "walls.0.thickness=0.4"),
    )
    position = np.array([20.0, -1.9])  # beyond its end
    there, back = (FloorMap(scenario).walls(position)[0] for scenario in (there, back))
    assert there == pytest.approx(back[::-1])
    assert there[0, 1] == pytest.approx(-1.8)


def test_an_oblique_walls_face_is_half_a_thickness_away(room):
    floor_map = FloorMap(room("walls.0.from=[7.0, 3.0]", "walls.0.to=[10.0, 7.0]", "walls.0.thickness=0.2"))
    (wall,) = floor_map.walls(np.zeros(2))
    along = np.array([0.6, 0.8])
    across = np.array([0.8, -0.6])  # towards the origin's side: the line passes it on the left
    side = np.sign((np.zeros(2) - [7.0, 3.0]) @ across)
    assert wall[0] == pytest.approx(np.array([7.0, 3.0]) - 0.1 * along + side * 0.1 * across)
    assert wall[1] == pytest.approx(np.array([10.0, 7.0]) + 0.1 * along + side * 0.1 * across)


def test_an_empty_room_has_no_discs_and_no_walls(empty):
    floor_map = FloorMap(empty())
    assert (floor_map.discs, floor_map.names) == ((), ())
    assert floor_map.walls(np.zeros(2)).shape == (0, 2, 2)
