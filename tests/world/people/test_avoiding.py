"""People who avoid others: both laws in both worlds."""

from itertools import combinations
from math import pi, sqrt

import numpy as np
import pytest

from mjnav.messages import WorldState
from mjnav.scene.people import Diagonal
from mjnav.scene.spec import Orca, Person, Scenario, SocialForce
from mjnav.world.people.pedestrians import Pedestrians
from mjnav.world.simulator import Simulator

FAR = (0.0, -30.0, 0.0)
LAWS = {"orca": Orca, "social_force": SocialForce}


def to(law, *goals, **keys):
    return LAWS[law](waypoints=goals, **({"speed": 1.2, "loop": False} | keys))


def walked(scenario: Scenario, duration: float, command=(0.0, 0.0), seed=0) -> np.ndarray:
    """Positions every 0.1 s, (T, P, 2)."""
    simulator, found = Simulator(scenario, seed, lidar=False), []
    for _ in range(round(10 * duration)):
        simulator.advance(0.1, command)
        found.append(simulator.state().people_position)
    return np.array(found)


def crossing(law, **keys):
    ways = (((-3.0, 0.0), (3.0, 0.0)), ((3.0, 0.1), (-3.0, 0.1)), ((0.1, -3.0), (0.1, 3.0)))
    return tuple(Person(start, to(law, goal, **keys)) for start, goal in ways)


@pytest.mark.parametrize("law", LAWS)
def test_people_who_cross_pass_without_touching_and_arrive(scene, engine, law):
    scenario = scene(engine=engine, start=FAR, people=crossing(law))
    positions = walked(scenario, 10.0)
    for i, j in combinations(range(3), 2):
        assert np.hypot(*(positions[:, i] - positions[:, j]).T).min() > 0.59
    for person, end in zip(scenario.people, positions[-1], strict=True):
        assert end == pytest.approx(person.behaviour.waypoints[-1], abs=0.15)


@pytest.mark.parametrize("law", LAWS)
def test_only_who_sees_the_robot_walks_round_it(scene, law):
    """The robot stands in the way, or far from it."""

    def way(start, sees):
        person = Person((-3.0, 0.05), to(law, (2.0, 0.05)), sees_robot=sees)
        return walked(scene(engine="kinematic", start=start, people=(person,)), 2.0)

    alone = way(FAR, None)
    np.testing.assert_array_equal(way((0.0, 0.0, 0.0), False), alone)
    assert np.abs(way((0.0, 0.0, 0.0), None) - alone).max() > 0.1
    assert np.hypot(*way((0.0, 0.0, 0.0), None)[:, 0].T).min() > 0.5


@pytest.mark.parametrize("law", LAWS)
def test_the_same_seed_leads_to_the_same_bits_however_the_time_is_divided(scene, law):
    keys = {"unsteadiness": 0.2, "diagonal": Diagonal(probability=0.05)}
    scenario = scene(engine="kinematic", start=(0.0, -2.0, 1.0), people=crossing(law, **keys))

    def hashed(seed, *durations):
        simulator = Simulator(scenario, seed, lidar=False)
        for duration in durations:
            simulator.advance(duration, (0.4, 0.1))
        return simulator.state_hash()

    assert hashed(1, *[0.01] * 100) == hashed(1, 0.3, 0.7) != hashed(2, 1.0)


@pytest.mark.parametrize("law", LAWS)
def test_unsteadiness_is_the_spread_of_each_component_of_the_velocity(scene, law):
    people = tuple(Person((4.0 * i, 0.0), to(law, (4.0 * i, 500.0), unsteadiness=0.3)) for i in range(3))
    walk = Pedestrians(scene(people=people, start=FAR), 3)
    position, calm = np.array([p.start for p in people]), Pedestrians(scene(people=people, start=FAR), 4)
    world = WorldState(0.0, np.array(FAR), np.zeros(2), position, np.tile([0.0, 1.2], (3, 1)))
    drawn = np.array([walk.velocities(world) for _ in range(1500)])
    assert drawn.std(axis=0) == pytest.approx(np.full((3, 2), 0.3), rel=0.08)
    assert drawn.mean(axis=0) == pytest.approx(np.tile([0.0, 1.2], (3, 1)), abs=0.05)
    assert np.abs(np.corrcoef(drawn.reshape(1500, 6).T) - np.eye(6)).max() < 0.12
    assert (calm.velocities(world) != drawn[0]).all()


def test_a_change_of_mind_turns_the_way_by_45_degrees_for_good(scene):
    def turns(probability, num=200):
        diagonal = Diagonal(probability=probability, every=4)
        people = tuple(
            Person((3.0 * i, 0.0), to("orca", (3.0 * i + 500.0, 0.0), acceleration=1000.0, diagonal=diagonal))
            for i in range(num)
        )
        walk = Pedestrians(scene(people=people, start=FAR), 0)
        position = np.array([p.start for p in people])
        world = WorldState(0.0, np.array(FAR), np.zeros(2), position, np.tile([1.2, 0.0], (num, 1)))
        return np.array([np.arctan2(*walk.velocities(world).T[::-1]) > pi / 8 for _ in range(9)])  # draws at 0, 4, 8

    assert turns(1.0).all()
    assert not turns(0.0).any()
    turned = turns(0.4)
    assert (turned[1:] >= turned[:-1]).all()
    share = turned.mean(axis=1)
    assert share[[0, 3, 4, 7, 8]] == pytest.approx([0.4, 0.4, 0.64, 0.64, 0.784], abs=3.5 * sqrt(0.25 / 200))
