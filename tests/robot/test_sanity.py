"""What the robot makes of readings before it uses them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.messages import Reading
from mjnav.motion.unicycle import integrate
from mjnav.robot.sanity import CALM, Sanity
from mjnav.scene.load import load
from mjnav.world.simulator import Simulator

SENSORS = ("odometry", "gyro", "pose", "detections", "scan")


def reading(k: int, **fields) -> Reading:
    """Reading k of a robot at 1 m/s, none of its values as before."""
    given = {
        "odometry": np.array([1.0, 1e-3 * k]),
        "gyro": 1e-3 * k,
        "pose": np.array([0.1 * k, 0.0, 0.0]),
        "detections": np.array([[4.0, 4.0 - 0.07 * k]]),
        "scan": np.full(20, 5.0 - 0.1 * k),
        "odometry_pose": np.array([0.1 * k, 0.0, 0.0]),
    }
    return Reading(time=0.1 * k, interval=0.1 if k else 0.0, **{**given, **fields})


@pytest.fixture
def sanity() -> Sanity:
    return Sanity(load("crossing1", {"estimation.robot.source": "pose"}))


def test_nothing_changes_where_nothing_is_wrong():
    scenario = load("crossing1", {"physics.engine": "kinematic"})
    world, sanity = Simulator(scenario, 3), Sanity(scenario)
    for _ in range(30):
        for one in world.sense():
            assert sanity.checked(one) is one
        world.advance(0.1, (0.5, 0.2))
    assert not sanity.take_events()


numbers = st.sampled_from([np.nan, np.inf, -np.inf, 1e300, -1e9, 0.0, 0.05, 1.0])


@given(st.lists(st.tuples(st.sampled_from(SENSORS), st.lists(numbers, min_size=2, max_size=3)), max_size=8))
def test_no_value_that_is_not_a_number_gets_any_further(faults):
    sanity = Sanity(load("crossing1"))
    for k, (name, values) in enumerate(faults):
        spoilt = reading(k)
        value = np.atleast_1d(np.array(getattr(spoilt, name), float))
        value.reshape(-1)[: len(values)] = values[: value.size]
        found = sanity.checked(replace(spoilt, **{name: float(value[0]) if name == "gyro" else value}))
        assert np.isfinite(found.odometry).all()
        assert np.isfinite(found.gyro)
        assert np.isfinite(found.pose).all()
        assert not np.isnan(found.scan).any()
        rows = np.isfinite(found.detections)
        assert (rows.all(axis=1) == rows.any(axis=1)).all()  # a person is there or is not
        assert not np.isinf(found.detections).any()


@pytest.mark.parametrize("name", SENSORS)
def test_a_part_that_cannot_be_used_is_the_last_one_that_could_and_is_named(sanity, name):
    first = reading(0)
    sanity.checked(first)
    lost = {"scan": np.zeros(0), "gyro": np.nan}.get(name, np.full_like(getattr(first, name), np.nan))
    found = sanity.checked(replace(reading(1), **{name: lost}, dropped=(name,)))
    assert found.dropped == (name,)
    expected = np.zeros(0) if name == "scan" else getattr(first, name)
    np.testing.assert_array_equal(getattr(found, name), expected)
    assert sanity.missing(name, 0.1) == pytest.approx(0.1)
    assert sanity.checked(reading(2)).dropped == ()
    assert sanity.missing(name, 0.2) == 0.0


@pytest.mark.parametrize("name", SENSORS)
def test_a_value_that_comes_again_to_the_last_bit_is_not_used_where_the_sensor_has_noise(sanity, name):
    sanity.checked(reading(0))
    same = replace(reading(1), **{name: getattr(reading(0), name)})
    assert sanity.checked(same).dropped == (name,)
    calm = Sanity(load("crossing1", {"noise.profile": "none"}))
    calm.checked(reading(0))
    assert calm.checked(same) is same


def test_a_late_pose_is_carried_on_by_odometry(sanity):
    twist, poses = (1.0, 0.5), [np.array([2.0, 1.0, 3.0])]
    way = [np.zeros(3)]
    for _ in range(5):
        poses.append(integrate(poses[-1], *twist, 0.1))
        way.append(integrate(way[-1], *twist, 0.1))
    for k in range(5):
        sanity.checked(reading(k, pose=poses[k], odometry_pose=way[k]))
    late = reading(5, pose=poses[2] + 1e-12, odometry_pose=way[5], ages=(("pose", 0.3),))
    np.testing.assert_allclose(sanity.checked(late).pose, poses[5], atol=1e-9)


def test_a_flickering_sensor_is_told_once_and_again_when_it_is_fine(sanity):
    told = []
    for k in range(40):
        bad = k in (5, 7, 9)
        sanity.checked(reading(k, gyro=np.nan) if bad else reading(k))
        told += [(k, event.level, event.text) for event in sanity.take_events()]
    again = 9 + round(CALM / 0.1)
    assert told == [
        (5, "warning", "gyro: not a number, from 0.5 s on"),
        (again, "info", "gyro: fine again since 0.9 s"),
    ]
