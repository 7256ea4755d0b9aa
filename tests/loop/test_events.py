"""How a run ends, by the truth, and what it tells in its log, once each."""

import numpy as np
import pytest

import mjnav
from mjnav.loop.events import Events, Referee
from mjnav.messages import Beliefs, Contact, Decision, RobotBelief, Status, Track, WorldState

TOUCH = (Contact("wall", "wall0", 12.4, 0.25),)


def state(x: float = 0.0, time: float = 0.0, contacts: tuple[Contact, ...] = ()) -> WorldState:
    return WorldState(time, np.array([x, 0.0, 0.0]), np.zeros(2), np.zeros((0, 2)), np.zeros((0, 2)), contacts)


@pytest.mark.parametrize(
    ("truth", "outcome"),
    [
        (state(0.0), None),
        (state(6.0, time=0.5), "goal"),
        (state(5.7 + 1e-9, time=0.5), "goal"),
        (state(5.69, time=0.5), None),
        (state(0.0, time=1.0), "timeout"),
        (state(0.0, time=1.0 - 1e-12), "timeout"),  # a time of whole steps is rounded
        (state(0.0, time=0.998), None),
        (state(0.0, contacts=TOUCH), "collision"),
        (state(6.0, time=1.0), "goal"),
        (state(6.0, time=1.0, contacts=TOUCH), "collision"),
    ],
)
def test_a_collision_counts_before_the_goal_and_the_goal_before_time(room, truth, outcome):
    assert Referee(room()).outcome(truth, None, on_last_leg=True) == outcome


@pytest.mark.parametrize(
    ("believed_x", "std", "outcome"),
    [(6.0, 0.2, "believed"), (6.0, 0.1, "timeout"), (5.4, 0.2, "timeout")],
)
def test_a_robot_out_of_time_that_waits_at_the_goal_by_its_belief_is_told_apart(room, believed_x, std, outcome):
    truth, mean = state(5.3, time=1.0), np.array([believed_x, 0.0, 0.0])  # 0.4 m short of the goal's circle
    belief = RobotBelief(1.0, mean[None], np.ones(1), mean, std**2 * np.eye(3), 1.0)
    assert Referee(room()).outcome(truth, belief, on_last_leg=True) == outcome
    assert Referee(room()).outcome(state(5.3, time=0.5), belief, on_last_leg=True) is None


def test_a_routes_last_point_counts_on_the_last_leg_only(room):
    referee = Referee(room("robot.waypoints=[[3.0, 0.0], [0.0, 0.0]]"))
    assert referee.outcome(state(0.0), None, on_last_leg=False) is None
    assert referee.outcome(state(0.0), None, on_last_leg=True) == "goal"


def decided(status: Status = Status.OK, wish: tuple[float, float] | None = None) -> Decision:
    return Decision(0.5, 0.0, status, wish=wish)


def test_a_status_is_told_when_it_changes_and_a_clipped_command_once():
    events = Events()
    found = [events.of_tick(state(), None, decided(*case)) for case in (
        (Status.OK,), (Status.INFEASIBLE, (2.0, 0.0)), (Status.INFEASIBLE, (2.0, 0.0)), (Status.OK,)
    )]  # fmt: skip
    assert [[(event.level, event.name) for event in tick] for tick in found] == [
        [],
        [("warning", "decision"), ("warning", "clipped")],
        [],
        [("info", "decision")],
    ]


def test_a_contact_with_a_person_says_whose_fault_it_was():
    def at(v, contacts=()):
        person = np.array([[1.0, 0.0]])
        return WorldState(0.0, np.zeros(3), np.array([v, 0.0]), person, np.zeros((1, 2)), contacts)

    touched = at(0.0, (Contact("person", "person0", 0.0, 0.05),))
    for v, text in ((0.6, "; the robot moved at 0.60 m/s: its own fault"), (0.0, "; the robot stood")):
        events = Events((False,))
        events.of_tick(at(v), None, decided())
        (event,) = events.of_tick(touched, None, decided())
        assert event.text.endswith(text)


def test_it_is_told_where_the_robot_was_put(tmp_path):
    overrides = {"faults.kidnap": {"time": 0.5, "pose": (2.0, -1.0, 0.0)}, "time_limit": 1.0}
    mjnav.run(mjnav.load_scenario("crossing1", overrides), log=tmp_path / "a.mcap")
    told = [m.value for m in mjnav.open_log(tmp_path / "a.mcap").messages("/events") if m.value.name == "kidnap"]
    assert [one.message[:35] for one in told] == ["the robot was put elsewhere: to 2.0"]


def test_a_depleted_belief_is_told_once_for_as_long_as_it_lasts():
    def beliefs(robot, person):
        weights = np.full(200, 0.005)
        track = Track("person0", 0.0, np.zeros((200, 4)), weights, np.zeros(4), np.eye(4), person, 0.3)
        return Beliefs(RobotBelief(0.0, np.zeros((200, 3)), weights, np.zeros(3), np.eye(3), robot), (track,))

    events = Events()
    cases = [beliefs(150.0, 4.1), beliefs(150.0, 3.9), None, beliefs(3.0, 2.0), beliefs(3.0, 90.0), beliefs(9.0, 3.0)]
    found = [[event.text for event in events.of_tick(state(), case, decided())] for case in cases]
    depleted = "{} of the 200 particles of {} count".format
    assert found == [[], [depleted(3.9, "person0")], [], [depleted(3.0, "robot")], [], [depleted(3.0, "person0")]]
