"""People who walk as they were recorded, under both engines."""

import numpy as np
import pytest

from mjnav.scene.crowd import TrackSplines
from mjnav.scene.people import Person, Replay
from mjnav.world.people.walk import CATCH_UP
from mjnav.world.simulator import Simulator

FAR = (0.0, -8.0, 0.0)
TIME = np.arange(0.0, 6.1, 0.4)
# Sets off, turns, stops for a while, goes on.
CURVE = np.column_stack([TIME, 1.2 * TIME - 0.9 * np.sin(TIME), 1.5 * np.cos(0.8 * TIME)])


def replayed(start=CURVE[0, 1:]):
    return Person(tuple(start), Replay(tuple(map(tuple, CURVE))))


@pytest.mark.parametrize(("engine", "bound"), [("kinematic", 1e-9), ("mujoco", 0.07)])
def test_a_replayed_person_follows_the_spline_of_the_track(scene, engine, bound):
    simulator = Simulator(scene(engine=engine, start=FAR, people=(replayed(),)), 0, lidar=False)
    spline = TrackSplines([CURVE])
    for _ in range(60):
        position = simulator.state().people_position[0]
        assert np.hypot(*(position - spline.positions(simulator.time)[0])) <= bound
        simulator.advance(0.1, (0.0, 0.0))


def test_who_was_put_off_the_track_walks_back_to_it_without_a_leap(scene, engine):
    simulator = Simulator(scene(engine=engine, start=FAR, people=(replayed(CURVE[0, 1:] + [0.0, 1.0]),)), 0)
    spline = TrackSplines([CURVE])
    fastest = max(np.hypot(*spline.velocities(time, 0.02)[0]) for time in np.arange(0.0, 5.9, 0.05))
    distance, speed = [], []
    for _ in range(29):
        simulator.advance(0.2, (0.0, 0.0))
        state = simulator.state()
        distance.append(np.hypot(*(state.people_position - spline.positions(simulator.time))[0]))
        speed.append(np.hypot(*state.people_velocity[0]))
    assert distance[0] > 0.7
    assert distance[-1] < 0.05
    assert max(speed) <= fastest + CATCH_UP + 0.05
