"""What people who see the robot make of it."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest

from mjnav.messages import WorldState
from mjnav.scene.spec import ConstantVelocity, Person, Wall
from mjnav.world.people.pedestrians import Pedestrians
from mjnav.world.people.temperament import FIELD_OF_VIEW

WALK = (1.0, 0.0)  # of everybody, from the origin


@pytest.fixture
def taken(scene):
    """The velocity of one person who wants WALK, for a robot at a pose; asked `times` in a row."""

    def make(temperament, robot, *, times=1, **rest):
        walls = rest.pop("walls", ())
        person = Person((0.0, 0.0), ConstantVelocity(WALK), temperament=temperament, **rest)
        walk = Pedestrians(scene(people=(person,), start=(0.0, 30.0, 0.0), walls=walls), 0)
        pose = np.array([*robot, 0.0][:3], float)
        world = WorldState(0.0, pose, np.zeros(2), np.zeros((1, 2)), np.array([WALK]))
        for _ in range(times):
            found = walk.velocities(world)[0]
        return found.tolist()

    return make


def test_each_temperament_does_what_its_rule_says(taken):
    assert taken("regular", (2.0, 0.0)) == [1.0, 0.0]
    assert taken("impassive", (2.0, 0.0)) == [1.0, 0.0]
    assert taken("yields", (3.9, 0.0)) == [0.0, 0.0]
    assert taken("curious", (0.0, 5.0)) == pytest.approx([0.0, 0.9])
    assert taken("curious", (1.4, 0.0)) == [0.0, 0.0]
    assert taken("scared", (0.0, 2.3)) == pytest.approx([0.6 * v / sqrt(1.2**2 + 2.0**2) for v in (1.2, -2.0)])
    # 1.1 m ahead of a robot that looks along +y from (2, 0)
    size = sqrt(2.0**2 + 1.1**2)
    assert taken("threatening", (2.0, 0.0, pi / 2)) == pytest.approx([2.0 * v / size for v in (2.0, 1.1)])
    assert taken("threatening", (0.4, -1.1, pi / 2)) == pytest.approx([0.5, 0.0], abs=1e-9)  # 0.4 m in 0.8 s


@pytest.mark.parametrize(
    ("temperament", "sight"), [("yields", 4.0), ("curious", 10.0), ("scared", 3.0), ("threatening", 4.0)]
)
def test_the_robot_counts_while_it_is_seen(taken, temperament, sight):
    def same(*robot, **rest):
        return taken(temperament, robot, **rest) == [1.0, 0.0]

    assert not same(sight - 0.01, 0.0)
    assert same(sight + 0.01, 0.0)
    for angle, seen in ((FIELD_OF_VIEW - 0.01, True), (FIELD_OF_VIEW + 0.01, False), (-FIELD_OF_VIEW + 0.01, True)):
        assert same(2.0 * cos(angle), 2.0 * sin(angle)) != seen
    assert same(2.0, 0.0, walls=(Wall((1.5, -1.0), (1.5, 1.0)),))
    assert same(2.0, 0.0, sees_robot=False)
