"""Scenes with more people, and with fewer."""

from dataclasses import replace
from math import hypot

import pytest

from mjnav import scene
from mjnav.errors import InvalidValue
from mjnav.loop.realtime.stress import crowd
from mjnav.scene.check import check


@pytest.mark.parametrize("num", [0, 2, 5])
def test_the_first_people_of_the_scene_are_kept(num):
    hall = scene.load("hall")
    assert len(hall.people) == 5
    found = crowd(hall, num)
    assert found.people == hall.people[:num]
    assert replace(found, people=hall.people) == hall


def test_more_are_placed_clear_of_everything():
    hall = scene.load("hall")
    found = crowd(hall, 40)
    assert len(found.people) == 40
    assert found.people[:5] == hall.people
    check(found)
    robot = hall.robot
    for i, person in enumerate(found.people):
        others = [(other.start, other.radius) for other in found.people[:i]] + [(robot.start[:2], robot.radius)]
        others += [(pillar.position, pillar.radius) for pillar in hall.pillars]
        for (x, y), radius in others:
            assert hypot(person.start[0] - x, person.start[1] - y) >= person.radius + radius
    assert scene.loads(scene.dumps(found)).people == found.people


def test_they_follow_the_seed_and_a_larger_crowd_holds_the_smaller(room):
    small, again, other, large = (crowd(room(seed=seed), num) for seed, num in ((3, 6), (3, 6), (4, 6), (3, 9)))
    assert small.people == again.people
    assert small.people[0] == other.people[0]
    assert all(a != b for a, b in zip(small.people[1:], other.people[1:], strict=True))
    assert large.people[:6] == small.people


def test_a_room_that_is_full_takes_no_more():
    text = """
    schema = 1
    name = "cell"
    robot = {start = [0.0, 0.0, 0.0], goal = [1.0, 0.0]}
    [[walls]]
    from = [-0.6, -0.6]
    to = [1.6, -0.6]
    [[walls]]
    from = [-0.6, 0.6]
    to = [1.6, 0.6]
    """
    with pytest.raises(InvalidValue, match=r"people: found 50; allowed: at most [1-4]: there is no room for more"):
        crowd(scene.loads(text), 50)
