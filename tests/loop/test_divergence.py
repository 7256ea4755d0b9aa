"""A belief that has left the truth is told in the log, as often as the figures count it."""

import numpy as np
import pytest

import mjnav
from mjnav import load_scenario
from mjnav.log import open_log
from mjnav.loop.events import DivergenceWatch
from mjnav.messages import Beliefs, RobotBelief, Track, WorldState

WEIGHTS = np.full(4, 0.25)


def robot(error: float) -> RobotBelief:
    mean = np.array([error, 0.0, -np.pi])
    return RobotBelief(0.0, np.zeros((4, 3)), WEIGHTS, mean, 0.01 * np.eye(3), 4.0)


def track(name: str, x: float) -> Track:
    mean = np.array([x, 0.0, 0.0, 0.0])
    return Track(name, 0.0, np.zeros((4, 4)), WEIGHTS, mean, 0.01 * np.eye(4), 4.0, 0.3)


def truth(k: int) -> WorldState:
    return WorldState(0.1 * k, np.array([0.0, 0.0, np.pi]), np.zeros(2), np.array([[5.0, 0.0]]), np.zeros((1, 2)))


def test_it_is_told_after_a_second_and_again_only_after_it_was_right():
    watch = DivergenceWatch(0.1)
    errors = [*[0.9] * 15, 0.0, *[0.9] * 9, 0.0, *[0.9] * 10]
    found = [[event.text for event in watch.of_tick(truth(k), Beliefs(robot(e), ()))] for k, e in enumerate(errors)]
    assert [k for k, texts in enumerate(found) if texts] == [9, len(errors) - 1]
    assert found[9] == ["the belief about robot is 0.90 m off, outside of its 99.9 % region for 1 s"]


@pytest.mark.parametrize("name", ["person0", "track7"])
def test_a_track_is_judged_by_its_person_whatever_its_name(name):
    watch = DivergenceWatch(0.1)
    found = [[*watch.of_tick(truth(k), Beliefs(robot(0.0), (track(name, 5.6),)))] for k in range(10)]
    (event,) = found[-1]
    assert (event.level, event.name) == ("warning", "divergence")
    assert event.text.startswith("the belief about person0 is 0.60 m off")


def test_the_log_has_as_many_as_the_figures_count(tmp_path):
    # Estimators that believe in much less noise than there is are too sure of themselves.
    keys = ["physics.engine=kinematic", "time_limit=8", "noise.profile=bimodal", "estimation.assumed_profile=none"]
    result = mjnav.run(load_scenario("crossing1", keys, seed=1), log=tmp_path / "a.mcap")
    events = [message.value for message in open_log(tmp_path / "a.mcap").messages("/events")]
    told = [event.message.split()[3] for event in events if event.name == "divergence"]
    counted = result.summary["robot_divergences"], result.summary["people_divergences"]
    assert (told.count("robot"), told.count("person0")) == counted
    assert sum(counted) > 0
