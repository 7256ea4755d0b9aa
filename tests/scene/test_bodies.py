"""The map that the robot has: what [estimation.map] takes from the world, adds to it and moves, and who goes by it."""

import numpy as np
import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.robot.seen_space import FloorMap
from mjnav.scene import loads
from mjnav.scene.ways import floor_of_robot

ROOM = """
schema = 1
name = "room"
[robot]
start = [0, 0, 0]
goal = [9, 0]
[[walls]]
from = [-1, -2]
to = [12, -2]
[[walls]]
from = [2, 2]
to = [4, 2]
[[tables]]
position = [3, -1]
[[tables]]
position = [6, -1]
[[pillars]]
position = [5, 1]
[[pillars]]
position = [7, 1]
height = 0.3
"""


def known(text):
    return loads(ROOM + "[estimation.map]\n" + text).known_bodies


def test_what_is_left_keeps_its_name_and_what_the_map_has_beyond_the_world_is_named_on():
    bodies = known('missing = ["table0", "wall0"]\n[[estimation.map.pillars]]\nposition = [1, 1]\n')
    assert bodies.names == ("wall1", "table1", "pillar0", "pillar1", "pillar2")
    assert [table.position for table in bodies.tables] == [(6.0, -1.0)]
    assert bodies.pillars[-1].position == (1.0, 1.0)


def test_a_shift_moves_tables_and_pillars_and_turns_each_about_its_own_centre():
    world, bodies = loads(ROOM).known_bodies, known("shift = [0.1, -0.2, 0.3]\n")
    assert bodies.walls == world.walls
    for before, after in zip(world.tables, bodies.tables, strict=True):
        arms = before.legs - before.position
        c, s = np.cos(0.3), np.sin(0.3)
        turned = arms @ np.array([[c, s], [-s, c]])
        assert after.legs == pytest.approx(np.add(before.position, [0.1, -0.2]) + turned)
    assert bodies.pillars[0].position == pytest.approx((5.1, 0.8))


@pytest.mark.parametrize("key", ["missing", "shifted"])
def test_a_name_that_is_none_is_refused_with_the_nearest_one(key):
    with pytest.raises(InvalidValue, match=rf"estimation.map.{key}.1: found 'tabel1'; .*did you mean 'table1'"):
        known(f'{key} = ["pillar0", "tabel1"]\n')
    with pytest.raises(InvalidValue, match="the scene has no walls"):
        mjnav.load_scenario("crossing1", {f"estimation.map.{key}": ["table0"]})


def test_controllers_go_by_the_map_and_the_world_stays_as_it_is():
    scenario = loads(ROOM + '[estimation.map]\nmissing = ["table0"]\nshift = [0.1, 0, 0]\n')
    floor, position = FloorMap(scenario), np.zeros(2)
    bodies = scenario.known_bodies
    expected = floor_of_robot(bodies.walls, bodies.tables, bodies.pillars)
    assert floor.known.discs == pytest.approx(expected.discs)
    assert floor.disc_names(position) == ("table1",) * 4 + ("pillar0", "pillar1")
    with mjnav.Simulation(scenario, log=False) as simulation:
        assert len(simulation.observe().obstacles) == len(floor.disc_names(position))
        assert len(simulation.scenario.tables) == 2
