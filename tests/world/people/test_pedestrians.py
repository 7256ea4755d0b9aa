import numpy as np
import pytest

from mjnav.messages import WorldState
from mjnav.scene import loads
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Robot, Scenario, StopAndGo, Table, Wall, Waypoints
from mjnav.scene.ways import Ways, floor_of_people
from mjnav.world.people.pedestrians import Pedestrians
from mjnav.world.simulator import Simulator

FAR = (0.0, -8.0, 0.0)


def walk(simulator: Simulator, duration: float, every: float = 0.02) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities over time, (T, P, 2) each."""
    states = []
    for _ in range(round(duration / every)):
        simulator.advance(every, (0.0, 0.0))
        states.append(simulator.state())
    return np.array([s.people_position for s in states]), np.array([s.people_velocity for s in states])


def test_stop_and_go_walks_for_go_time_and_stands_for_stop_time(scene, engine):
    behaviour = StopAndGo((1.0, 0.0), go_time=1.0, stop_time=1.5)
    simulator = Simulator(scene(engine=engine, start=FAR, people=(Person((0.0, 0.0), behaviour),)), 0)
    _, velocity = walk(simulator, 3.4)
    speed = velocity[:, 0, 0]
    time = 0.02 * np.arange(1, len(speed) + 1)
    assert speed[time < 1.0].min() == pytest.approx(1.0, abs=1e-6)
    assert speed[(time > 2.1) & (time < 2.49)].max() < 0.02  # the servo's time constant is 0.175 s
    assert speed[-1] > 0.97


def test_waypoints_are_visited_in_turn_and_again(scene, engine):
    corners = ((2.0, 0.0), (2.0, 2.0), (0.0, 0.0))
    simulator = Simulator(scene(engine=engine, start=FAR, people=(Person((0.0, 0.0), Waypoints(corners)),)), 0)
    position, velocity = walk(simulator, 18.0)
    for lap in np.array_split(position, 2):
        for corner in corners:
            assert np.hypot(*(lap[:, 0] - corner).T).min() < 0.25
    assert np.hypot(*velocity[:, 0].T).max() < 1.0 + 1e-6


def test_behaviours_are_mixed_without_mixing_up_people():
    people = (
        Person((0.0, 0.0), ConstantVelocity((1.0, 0.0))),
        Person((5.0, 0.0), Waypoints(((5.0, 3.0),), speed=0.5)),
        Person((9.0, 0.0), ConstantVelocity((0.0, -2.0))),
        Person((7.0, 0.0), StopAndGo((0.3, 0.0), 1.0, 1.0)),
    )
    positions = np.array([person.start for person in people])
    pedestrians = Pedestrians(Scenario("mixed", Robot((0.0, 5.0, 0.0), (1.0, 5.0)), people=people), seed=0)
    for time, last in ((0.5, 0.3), (1.5, 0.0)):
        world = WorldState(time, np.zeros(3), np.zeros(2), positions, np.zeros((4, 2)))
        np.testing.assert_allclose(pedestrians.velocities(world), [[1, 0], [0, 0.5], [0, -2], [last, 0]])
    nobody = WorldState(0.0, np.zeros(3), np.zeros(2), np.zeros((0, 2)), np.zeros((0, 2)))
    assert Pedestrians(Scenario("empty", Robot((0.0, 0.0, 0.0), (1.0, 0.0))), seed=0).velocities(nobody).shape == (0, 2)


@pytest.mark.parametrize(
    "obstacle",
    [
        {"walls": (Wall((2.0, -2.0), (2.0, 2.0)),)},
        {"pillars": (Pillar((2.0, 0.0), 0.25),)},
        {"tables": (Table((2.5, 0.4), size=(1.0, 0.8)),)},
    ],
    ids=["wall", "pillar", "table"],
)
def test_a_blocked_person_stays_where_it_is(scene, engine, obstacle):
    person = Person((0.0, 0.0), ConstantVelocity((1.0, 0.0)))
    simulator = Simulator(scene(engine=engine, start=FAR, people=(person,), **obstacle), 0)
    position, velocity = walk(simulator, 4.0)
    assert position[:, 0, 0].max() < 1.76
    np.testing.assert_allclose(position[-1, 0], position[-50, 0], atol=0.005)
    assert np.hypot(*velocity[-1, 0]) < 0.01


WALL_IN_THE_WAY = """schema = 1
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


def test_a_person_walks_around_a_wall_to_the_waypoint_and_touches_nothing(engine):
    scenario = loads(WALL_IN_THE_WAY.replace("ENGINE", engine))
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
