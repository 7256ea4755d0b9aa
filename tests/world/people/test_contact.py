"""People and people: they do not overlap, get past one another, and step apart where they overlap at the start."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.scene.spec import ConstantVelocity, Person, Physics, Pillar, Robot, Scenario, Wall
from mjnav.world.kinematic_engine import KinematicEngine
from mjnav.world.simulator import Simulator

FAR = (0.0, -8.0, 0.0)
TOLERANCE = {"kinematic": 1e-6, "mujoco": 0.02}  # [m] by which two people may overlap
component = st.floats(-2.0, 2.0)


def gaps(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Between the surfaces of all pairs (..., P (P - 1) / 2) of people at (..., P, 2)."""
    i, j = np.triu_indices(len(radii), 1)
    return np.hypot(*np.moveaxis(positions[..., i, :] - positions[..., j, :], -1, 0)) - (radii[i] + radii[j])


def walked(scenario: Scenario, duration: float) -> np.ndarray:
    """Positions (T, P, 2) every 0.02 s."""
    simulator, found = Simulator(scenario, 0, lidar=False), []
    for _ in range(round(duration / 0.02)):
        simulator.advance(0.02, (0.0, 0.0))
        found.append(simulator.state().people_position)
    return np.array(found)


@settings(max_examples=30, deadline=None)
@given(st.data())
def test_no_two_people_come_closer_than_touching_whatever_they_want(data):
    starts = [(0.75 * x, 0.75 * y) for x in range(3) for y in range(2)]
    radii = data.draw(st.lists(st.floats(0.1, 0.37), min_size=6, max_size=6))
    people = tuple(Person(start, ConstantVelocity((0.0, 0.0)), r) for start, r in zip(starts, radii, strict=True))
    room = (Wall((-1.0, 2.0), (3.0, 2.0)), Wall((2.2, -2.0), (2.2, 3.0)))
    robot, physics = Robot((-0.8, 0.0, 0.0), (5.0, 0.0)), Physics("kinematic")
    scenario = Scenario("t", robot, people=people, walls=room, pillars=(Pillar((1.0, -0.9)),), physics=physics)
    engine = KinematicEngine(scenario, np.zeros((6, 2)))
    for _ in range(5):
        engine.walk(np.array(data.draw(st.lists(st.tuples(component, component), min_size=6, max_size=6))))
        engine.advance(np.tile([0.5, 0.3], (40, 1)))
        position = engine.people_position()
        assert gaps(position, np.array(radii)).min() > -1e-6
        assert (position[:, 0] + radii).max() < 2.15 + 1e-6
        assert (np.hypot(*(position - engine.robot_pose()[:2]).T) - radii).min() > robot.radius - 1e-6


@pytest.mark.parametrize("offset", [0.0, 0.2])
def test_two_who_meet_head_on_get_past_each_other(scene, engine, offset):
    people = (Person((0.0, 0.0), ConstantVelocity((1.0, 0.0))), Person((2.0, offset), ConstantVelocity((-1.0, 0.0))))
    position = walked(scene(engine=engine, start=FAR, people=people), 4.0)
    assert gaps(position, np.array([0.3, 0.3])).min() > -TOLERANCE[engine]
    assert position[-1, 0, 0] > 2.5
    assert position[-1, 1, 0] < -0.5
    if offset == 0.0:
        assert position[-1, 0, 1] < 0.0 < position[-1, 1, 1]  # each to their own right


@pytest.mark.parametrize("second", [(0.3, 0.1), (0.0, 0.0)])
def test_people_who_overlap_at_the_start_step_apart_and_are_not_thrown(scene, engine, second):
    people = tuple(Person(start, ConstantVelocity((0.0, 0.0))) for start in ((0.0, 0.0), second))
    position = walked(scene(engine=engine, start=FAR, people=people), 2.0)
    assert -TOLERANCE[engine] < gaps(position[-1], np.array([0.3, 0.3])).min() < 0.12
    assert np.hypot(*np.diff(position, axis=0).T).max() < 0.4 * 0.02  # [m] in 0.02 s
