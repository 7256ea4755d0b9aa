"""Random scenes: the layout of a seed, what it keeps to, and what is refused before anything starts."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.stats import kstest, norm, uniform

from mjnav.errors import InvalidValue
from mjnav.geometry.shortest_way import WayMap
from mjnav.scene import dumps, loads
from mjnav.scene.check import is_avoidable
from mjnav.scene.draws import PURPOSES, Layout
from mjnav.scene.load import with_seed
from mjnav.scene.ways import floor_of_people, floor_of_robot

ROOM = """
schema = 1
name = "drawn"
[robot]
start = [0.0, 0.0, 0.0]
goal_area = [[8.0, -2.0], [10.0, 2.0]]
""" + "".join(
    f"[[walls]]\nfrom = {a}\nto = {b}\n"
    for a, b in [("[-1, -3]", "[11, -3]"), ("[11, -3]", "[11, 3]"), ("[11, 3]", "[-1, 3]"), ("[-1, 3]", "[-1, -3]")]
)
TABLES = "[[tables]]\ncount = [1, 2]\narea = [[2, -2], [9, 2]]\nyaw = { low = -3.1, high = 3.1 }\n"
PILLARS = "[[pillars]]\ncount = [0, 3]\narea = [[2, -2], [9, 2]]\nradius = { low = 0.1, high = 0.3 }\n"
PEOPLE = """[[people]]
count = [2, 5]
area = [[0, -2.5], [10, 2.5]]
behaviour = { one_of = ["constant_velocity", "waypoints"], shares = [1, 3] }
speed = { mean = 1.29, std = 0.19 }
radius = { low = 0.2, high = 0.35 }
waypoints = { area = [[0, -2.4], [10, 2.4]], count = [1, 3] }
"""
SCENE = ROOM + TABLES + PILLARS + PEOPLE


def drawn(text: str, seed: int, *overrides: str):
    return loads(text, overrides, seed=seed)


@settings(deadline=None, suppress_health_check=[HealthCheck.too_slow], max_examples=8)
@given(st.integers(0, 2**63 - 1))
def test_a_layout_is_apart_by_the_gap_has_a_way_and_reads_back_to_itself(seed):
    scene = drawn(SCENE, seed)
    assert scene.layout == Layout(seed=seed)
    gap = 2 * scene.robot.radius + 0.4
    for table in scene.tables:
        others = [other for other in scene.tables if other is not table]
        floor = floor_of_people(scene.walls, others, scene.pillars)
        assert floor.clearance(table.legs).min() >= gap - 0.05  # legs stand inside the table's edge
    for pillar in scene.pillars:
        others = [other for other in scene.pillars if other is not pillar]
        floor = floor_of_people(scene.walls, scene.tables, others)
        assert floor.clearance([pillar.position]).min() >= pillar.radius + gap - 0.05
    people = floor_of_people(scene.walls, scene.tables, scene.pillars)
    for person in scene.people:
        assert people.clearance([person.start]).min() >= person.radius
    for one, other in combinations(scene.people, 2):
        assert np.hypot(*np.subtract(one.start, other.start)) >= one.radius + other.radius
    ways = WayMap(floor_of_robot(scene.walls, scene.tables, scene.pillars), scene.robot.radius)
    assert ways.way(scene.robot.start[:2], scene.robot.goal) is not None
    assert is_avoidable(scene)
    assert loads(dumps(scene)) == scene == loads(dumps(scene, draft=True)) == with_seed(drawn(SCENE, 0), seed)


def test_layouts_of_many_seeds_are_as_their_ranges_say():
    scenes = [drawn(ROOM + PEOPLE, seed) for seed in range(80)]
    people = [person for scene in scenes for person in scene.people]
    walkers = [person.behaviour for person in people if hasattr(person.behaviour, "waypoints")]
    assert {len(scene.people) for scene in scenes} == {2, 3, 4, 5}
    assert kstest([walk.speed for walk in walkers], norm(1.29, 0.19).cdf).pvalue > 1e-3
    assert kstest([person.radius for person in people], uniform(0.2, 0.15).cdf).pvalue > 1e-3
    assert {len(walk.waypoints) for walk in walkers} == {1, 2, 3}
    assert len(walkers) / len(people) == pytest.approx(0.75, abs=4 * np.sqrt(0.75 * 0.25 / len(people)))
    assert len({dumps(scene) for scene in scenes}) == len(scenes)


def test_another_entry_or_key_moves_no_draw():
    before = drawn(ROOM + PEOPLE, 4)
    pillar = "[[pillars]]\ncount = 1\nposition = [30.0, { low = 8.0, high = 9.0 }]\n"
    after = drawn(ROOM + pillar + PEOPLE + "sees_robot = { one_of = [true, false] }\n" + PEOPLE, 4)
    number = len(before.people)
    assert [person.start for person in after.people[:number]] == [person.start for person in before.people]
    assert [person.behaviour for person in after.people[:number]] == [person.behaviour for person in before.people]
    assert len(after.people) > number


def test_a_layout_is_held_while_the_seed_of_the_run_varies():
    scenes = [drawn(SCENE, seed, "layout.seed=7") for seed in (1, 2)]
    assert scenes[0].people == scenes[1].people == drawn(SCENE, 7).people
    assert [scene.seed for scene in scenes] == [1, 2]
    assert with_seed(scenes[0], 9).tables == scenes[0].tables


def test_no_layout_for_training_is_one_for_reporting():
    roots = {purpose: {Layout(seed, purpose).root() for seed in range(1000)} for purpose in PURPOSES}
    assert not roots["training"] & roots["reporting"]
    assert {len(found) for found in roots.values()} == {1000}
    layouts = {
        purpose: {str(drawn(ROOM + PEOPLE, seed, f"layout.purpose={purpose}").people) for seed in range(20)}
        for purpose in PURPOSES
    }
    assert not layouts["training"] & layouts["reporting"]
    assert {len(found) for found in layouts.values()} == {20}


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("people.0.speed={low=-1, high=1}", "people.0.speed.low: found -1.0; allowed: a number from 0 to 5 m/s"),
        ("people.0.count=[3, 2]", "people.0.count.1: found 2; allowed: a whole number from 3 on"),
        ("people.0.behaviour.shares=[0, 0]", "people.0.behaviour.shares: .*at least one is more than 0"),
        ("people.0.start=[1, 1]", "people.0.area: .*area or start, not both"),
        ("walls.1.from=[{low=1, high=2}, 0]", "walls.1.count: found nothing; allowed: count = 1 or more"),
        ("tables.0.count=60", "layout.tries: found 3; .*tables.0: none of 200 places of tables.0"),
        ("walls.4={from=[5, -3], to=[5, 3]}", "layout.tries: found 3; .*the robot has no way to its goal"),
    ],
)
def test_what_cannot_be_drawn_is_told_by_its_place_in_the_file(override, message):
    text = f"{SCENE}[[walls]]\nfrom = [-1, 3]\nto = [-1, 2]\n[layout]\ntries = 3\n"
    with pytest.raises(InvalidValue, match=message):
        loads(text, [override])


def test_a_scene_without_room_is_refused_long_before_all_its_layouts_are_tried():
    crowded = ROOM + "[[people]]\ncount = 4\nstart = [2.0, -1.5]\nbehaviour = 'waypoints'\nwaypoints = [[3.0, -1.5]]\n"
    with pytest.raises(InvalidValue, match=r"layout: found '20 layouts without room'; .*people\.0: none of 200 places"):
        loads(f"{crowded}[layout]\ntries = 10000\n")
