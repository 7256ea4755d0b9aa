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
