"""When a lidar takes its beams, and from where: a scan of what moves is distorted as geometry says."""

import numpy as np
import pytest

from mjnav.scene.sensors import LidarSpec
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Sensors, Wall
from mjnav.world.simulator import Simulator

CLEAN = {"mixed": 0.0, "missing": 0.0, "bias": 0.0, "spread": 0.0, "resolution": 0.0, "min_range": 0.0}


def readings_of(scenario, duration: float, command=(0.3, 1.5), slices: int = 1) -> list:
    simulator = Simulator(scenario, 3)
    for _ in range(round(duration * 10) * slices):
        simulator.advance(0.1 / slices, command)
    return list(simulator.sense())


@pytest.mark.parametrize(
    ("model", "fresh", "turn"), [("lds-01", 10, 0.2), ("rplidar-a1", 11, 1 / 5.5), ("utm-30lx", 20, 0.01875)]
)
def test_a_reading_has_the_latest_whole_turn_once(scene, model, fresh, turn):
    readings = readings_of(scene(engine="kinematic", sensors=Sensors(lidar=LidarSpec(model))), 2.0)
    first, *others = readings
    assert first.scan_times.size == 0
    scans = [reading for reading in others if reading.scan.size]
    assert len(scans) == fresh
    before = -1.0
    for reading in scans:
        times = reading.scan_times
        assert times.shape == reading.scan.shape == first.scan.shape
        assert (np.diff(times) >= 0.0).all()
        assert times[-1] - times[0] == pytest.approx(turn, abs=0.013)  # a packet less than a turn, in whole steps
        assert before < times[0]
        assert times[-1] <= reading.time
        before = times[-1]


def test_a_turning_robot_sees_each_beam_from_where_it_is_then(scene, engine):
    """A wall, a pillar and a person who walks, from a lidar off the centre of a robot that turns at 1.5 rad/s."""
    lidar = LidarSpec("lds-01", max_range=10.0, mount=(0.1, 0.05, 0.3), beam_width=0.0, **CLEAN)
    person = Person((1.5, -1.5), ConstantVelocity((0.2, 1.0)))
    scenario = scene(
        engine=engine,
        walls=(Wall((3.0, -30.0), (3.0, 30.0)),),
        pillars=(Pillar((-1.5, 0.5), 0.3),),
        people=(person,),
        sensors=Sensors(lidar=lidar),
    )
    reading = readings_of(scenario, 0.8)[-1]
    assert reading.scan.size
    poses, people = {}, {}
    witness = Simulator(scenario, 3, lidar=False)
    for _ in range(400):
        state = witness.state()
        poses[round(state.time, 6)], people[round(state.time, 6)] = state.robot_pose, state.people_position[0]
        witness.advance(0.002, (0.3, 1.5))
    expected, still = [], []
    for when, angle in zip(reading.scan_times.round(6), scenario.sensors.scanner.angles, strict=True):
        for seen_from, found in ((when, expected), (max(poses), still)):
            x, y, heading = poses[seen_from]
            body = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
            origin = np.array([x, y]) + body @ lidar.mount[:2]
            direction = np.array([np.cos(heading + 0.3 + angle), np.sin(heading + 0.3 + angle)])
            discs = ((np.array([-1.5, 0.5]), 0.3), (people[when], person.radius))
            found.append(min([to_disc(origin, direction, *disc) for disc in discs] + [to_wall(origin, direction)]))
    np.testing.assert_allclose(reading.scan, expected, atol=1e-6)
    assert np.isfinite(expected).sum() > 100
    both = np.isfinite(still) & np.isfinite(expected)
    assert np.abs(np.array(still)[both] - np.array(expected)[both]).max() > 0.3  # a scan taken at once is another


def to_wall(origin, direction) -> float:
    distance = (2.95 - origin[0]) / direction[0]
    return distance if 0.0 < distance <= 10.0 else np.inf


def to_disc(origin, direction, centre, radius) -> float:
    ahead = direction @ (centre - origin)
    aside = abs(direction[0] * (centre - origin)[1] - direction[1] * (centre - origin)[0])
    return ahead - np.sqrt(radius**2 - aside**2) if ahead > 0.0 and aside < radius else np.inf


def test_the_same_bits_however_time_is_sliced(clutter, engine):
    scenario = clutter(engine=engine, profile="pearson", sensors=Sensors(lidar=LidarSpec("lds-01", rate=7.0)))
    for one, other in zip(readings_of(scenario, 0.9), readings_of(scenario, 0.9, slices=25), strict=True):
        np.testing.assert_array_equal(one.scan, other.scan)
        np.testing.assert_array_equal(one.scan_times, other.scan_times)
