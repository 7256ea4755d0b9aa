"""The scenes that come with mjnav, and where its data is found."""

import numpy as np
import pytest

from mjnav.scene import data_folder, describe, load, names
from mjnav.scene.spec import ConstantVelocity

NAMES = tuple(sorted(file.stem for file in data_folder("runs").glob("*.toml")))


def test_the_shipped_scenes_are_listed_by_name_with_one_line_each():
    assert tuple(sorted(names())) == NAMES
    assert {"hall", "corridor12", "blind7", "doorway", "crossroads", "office", "rooms", "crowds"} < set(NAMES)
    assert all(text and "\n" not in text for _, text in describe())


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_scene_loads_and_is_named_after_its_file(name):
    scenario = load(name)
    assert scenario.name == name
    assert scenario.source == str(data_folder("runs") / f"{name}.toml")
    assert load(scenario.source) == scenario


def straight_on(robot, time):
    """Where the robot is that accelerates at its limit to its preferred speed and drives on, (T, 2)."""
    ramp = robot.preferred_speed / robot.max_acceleration
    driven = np.where(
        time < ramp,
        0.5 * robot.max_acceleration * time**2,
        robot.preferred_speed * (time - 0.5 * ramp),
    )
    x, y, heading = robot.start
    return np.stack([x + driven * np.cos(heading), y + driven * np.sin(heading)], axis=-1)


@pytest.mark.parametrize(("name", "num_people"), [("crossing1", 1), ("crossing2", 2), ("crossing3", 3), ("five", 5)])
@pytest.mark.parametrize("delay", [0.0, 0.1, 0.3])
def test_each_person_of_a_crossing_hits_the_robot_that_drives_straight_on(name, num_people, delay):
    scenario = load(name)
    robot = scenario.robot
    x, y, heading = robot.start
    assert np.arctan2(robot.goal[1] - y, robot.goal[0] - x) == heading
    time = np.arange(0.0, np.hypot(robot.goal[0] - x, robot.goal[1] - y) / robot.preferred_speed, 0.01)
    way = straight_on(robot, np.maximum(time - delay, 0.0))
    assert len(scenario.people) == num_people
    assert scenario.walls + scenario.tables + scenario.pillars == ()
    for person in scenario.people:
        assert isinstance(person.behaviour, ConstantVelocity)
        distance = np.linalg.norm(way - person.start - time[:, None] * person.behaviour.velocity, axis=-1)
        assert distance.min() < 0.8 * (robot.radius + person.radius)
        assert distance[0] > 2.0
