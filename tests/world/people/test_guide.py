"""People who walk around walls, tables and pillars."""

import numpy as np
import pytest

from mjnav.scene import loads
from mjnav.scene.ways import Ways, floor_of_people
from mjnav.world.simulator import Simulator

SCENE = """schema = 1
name = "around"
[robot]
start = [-6.0, 0.0, 0.0]
goal = [9.0, 0.0]
[physics]
engine = "ENGINE"
[[walls]]
from = [0.0, -2.0]
to = [0.0, 2.0]
[[tables]]
position = [0.2, 3.6]
[[people]]
start = [-2.0, 0.0]
behaviour = "waypoints"
waypoints = [[2.0, 0.5]]
speed = 1.2
loop = false
"""


def scene(engine="kinematic"):
    return loads(SCENE.replace("ENGINE", engine))


@pytest.mark.parametrize("engine", ["kinematic", "mujoco"])
def test_a_person_walks_around_a_wall_to_the_waypoint_and_touches_nothing(engine):
    scenario = scene(engine)
    floor = floor_of_people(scenario.walls, scenario.tables, scenario.pillars)
    simulator = Simulator(scenario, 0, lidar=False)
    places = []
    for _ in range(80):
        simulator.advance(0.1, (0.0, 0.0))
        places.append(simulator.state().people_position[0])
    assert places[-1] == pytest.approx([2.0, 0.5], abs=0.01)
    assert floor.clearance(places).min() >= scenario.people[0].radius
    walked = np.linalg.norm(np.diff([scenario.people[0].start, *places], axis=0), axis=1).sum()
    planned = Ways(floor).plan((-2.0, 0.0), (2.0, 0.5), 0.3)
    assert planned is not None
    length = np.linalg.norm(np.diff([(-2.0, 0.0), *planned], axis=0), axis=1).sum()
    assert walked == pytest.approx(length, rel=0.02)
