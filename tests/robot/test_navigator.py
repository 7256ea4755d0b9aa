"""What is on board of the robot: from readings to the command in force."""

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.messages import Decision, Observation, Reading, Status
from mjnav.robot.navigator import Navigator


def navigator(scenario, samples: int = 25) -> Navigator:
    controller = make_controller("mean", scenario.robot.limits, scenario.control.period, samples=samples)
    return Navigator(scenario, scenario.seed, controller)


def reading(scenario, x: float, y: float = 0.0, time: float = 0.0) -> Reading:
    people = np.array([person.start for person in scenario.people], float).reshape(-1, 2)
    return Reading(time, 0.1 if time else 0.0, np.zeros(2), 0.0, np.array([x, y, 0.0]), people, np.full(360, np.inf))


class Always:
    """Decides the same at every tick, and keeps what it was shown."""

    def __init__(self, controller, v: float, omega: float):
        self.parameters, self._chosen, self.seen = controller.parameters, (v, omega), []

    def decide(self, observation: Observation) -> Decision:
        self.seen.append(observation)
        return Decision(*self._chosen, Status.OK)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_an_observation_stands_at_the_moment_at_which_its_decision_takes_effect(room, delay):
    scenario = room(f"control.delay={delay}", "noise.profile=none")
    board = navigator(scenario)
    board.controller = Always(board.controller, 0.05, 0.1)
    beliefs = None
    for tick in range(6):
        beliefs = board.estimate((reading(scenario, 0.0, time=0.1 * tick),), beliefs)
        observation = board.predict(tick, beliefs)
        assert observation.time == pytest.approx(0.1 * (tick + delay))
        assert observation.twist.tolist() == ([0.05, 0.1] if tick else [0.0, 0.0])
        decision = board.decide(observation)
        command, switches = board.actuate(tick, decision, spent=0.05)
        assert switches == []
        assert command.tolist() == ([0.05, 0.1] if tick >= delay else [0.0, 0.0])


def test_without_prediction_an_observation_stands_where_the_robot_was_believed(room):
    scenario = room("control.delay=2", "control.prediction=false", "noise.profile=none")
    board = navigator(scenario)
    board.controller = Always(board.controller, 0.5, 0.0)
    beliefs = None
    for tick in range(6):
        now = reading(scenario, 0.05 * tick, time=0.1 * tick)
        beliefs = board.estimate((now,), beliefs)
        observation = board.predict(tick, beliefs)
        assert observation.time == now.time
        np.testing.assert_allclose(observation.robot_pose.mean(0), beliefs.robot.particles.mean(0), atol=0.02)
        board.actuate(tick, board.decide(observation), spent=0.0)


def test_lanes_come_with_draws_of_their_noise(room):
    scenario = room("lanes={left=[0.0, 1.0, -1.5], right=[0.0, 1.0, 1.5]}")
    board = navigator(scenario, samples=400)
    lanes = board.predict(0, board.estimate((reading(scenario, 0.0),), None)).lanes
    assert (lanes.left, lanes.right) == (scenario.lanes.left, scenario.lanes.right)
    for offset in (lanes.left_offset, lanes.right_offset):
        assert offset.std() == pytest.approx(0.08, rel=0.2)
    assert abs(np.corrcoef(lanes.left_offset, lanes.right_offset)[0, 1]) < 0.2


def test_waypoints_are_made_for_one_after_another_and_the_last_is_never_dropped(room):
    scenario = room(
        "noise.profile=none",
        "robot.waypoints=[[0.5, 0.0], [0.6, 0.0], [2.0, 0.0]]",
        "robot.goal_tolerance=0.2",
        "estimation.robot.source=direct",
    )
    board = navigator(scenario)
    assert (board.goal.tolist(), board.on_last_leg) == ([0.5, 0.0], False)
    beliefs = board.estimate((reading(scenario, 0.0),), None)
    assert board.goal.tolist() == [0.5, 0.0]
    beliefs = board.estimate((reading(scenario, 0.5, time=0.1),), beliefs)  # near both of the first two
    assert (board.goal.tolist(), board.on_last_leg) == ([2.0, 0.0], True)
    beliefs = board.estimate((reading(scenario, 2.0, time=0.2),), beliefs)
    assert board.goal.tolist() == [2.0, 0.0]
    assert board.predict(2, beliefs).goal.tolist() == [2.0, 0.0]
