"""The way that is planned for every method: where it leads, what it keeps clear of, and what happens when blocked."""

import numpy as np
import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import TIGHT, WayField
from mjnav.messages import Decision, KnownMap, RobotLimits, Status, Track
from mjnav.robot.wayfinder import RECOVERY, STOOD, Wayfinder
from mjnav.scene import loads
from mjnav.scene.route import Route

LIMITS = RobotLimits()
POSE = np.zeros(3)
GOAL = np.array([6.0, 0.0])
EMPTY = KnownMap(np.zeros((0, 2, 2)), np.zeros(0), np.zeros((0, 3)))
TWO_DOORS = """
schema = 1
name = "two-doors"
time_limit = 40.0
walls = [
  { from = [3.0, -4.0], to = [3.0, -2.6] },
  { from = [3.0, -1.4], to = [3.0, -0.5] },
  { from = [3.0, 0.5], to = [3.0, 4.0] },
]
[robot]
start = [0.0, 0.0, 0.0]
goal = [6.0, 0.0]
[physics]
engine = "kinematic"
[[people]]
start = [3.0, 0.0]
behaviour = "constant_velocity"
velocity = [0.0, 0.0]
"""


def map_of(*walls):
    return KnownMap(np.array(walls, float).reshape(-1, 2, 2), np.full(len(walls), 0.1), np.zeros((0, 3)))


def standing(x, y, velocity=(0.0, 0.0), name="person0"):
    mean = np.array([x, y, *velocity])
    return Track(name, 0.0, mean[None], np.ones(1), mean, np.zeros((4, 4)), 1.0, 0.3)


def test_on_a_free_floor_the_point_is_so_far_ahead_and_at_last_the_goal():
    finder = Wayfinder(Route(ahead=2.0), LIMITS)
    finder.follow(0.0, POSE, GOAL, EMPTY, ())
    assert finder.ahead(np.array([1.0, 0.0]))[0] == pytest.approx([3.0, 0.0])
    assert finder.ahead(np.array([5.0, 0.0]))[0].tolist() == GOAL.tolist()


def test_the_line_of_a_way_goes_from_the_robot_to_the_goal_around_what_stands():
    known, goal = map_of([[3.0, -2.0], [3.0, 2.0]]), np.array([6.0, 0.8])
    finder = Wayfinder(Route(clearance=0.2), LIMITS)
    finder.follow(0.0, POSE, goal, known, ())
    line = finder.ahead(POSE[:2])[1].line
    assert line[[0, -1]].tolist() == [[0.0, 0.0], goal.tolist()]
    floor = Floor(np.zeros((0, 3)), np.array([[3.0, 0.0, 0.0, 1.0, 2.0, 0.05]]))
    assert floor.clearance(line).min() > LIMITS.radius
    length = np.hypot(*np.diff(line, axis=0).T).sum()
    room = LIMITS.radius + 0.2
    assert length == pytest.approx(np.hypot(3.0, 2.0 + room) + np.hypot(3.0, 1.2 + room), rel=0.06)


def test_behind_a_wall_the_point_is_one_that_the_robot_can_drive_to_straight():
    rng = np.random.default_rng(2)
    finder, known = Wayfinder(Route(ahead=3.0), LIMITS), map_of([[3.0, -2.0], [3.0, 2.0]])
    finder.follow(0.0, POSE, GOAL, known, ())
    floor = Floor(np.zeros((0, 3)), np.array([[3.0, 0.0, 0.0, 1.0, 2.0, 0.05]]))
    for position in rng.uniform([-1.0, -3.0], [2.5, 3.0], (50, 2)):
        point, _ = finder.ahead(position)
        assert 0.05 < np.hypot(*(point - position)) <= 3.0 + 1e-9
        assert floor.blocking(position, point, LIMITS.radius) is None


def test_beside_a_body_a_way_costs_more_by_how_little_it_keeps_clear():
    """In a corridor whose middle lacks half of the clearance the slowness is (1 + TIGHT) / 2, all along."""
    radius, soft = 0.22, 2.0
    half = radius + 0.5 * soft
    boxes = np.array([[5.0, sign * (half + 0.05), 1.0, 0.0, 6.0, 0.05] for sign in (-1, 1)])
    floor = Floor(np.zeros((0, 3)), boxes)
    ways = [WayField.of(floor, [9.0, 0.0], radius, soft=s).way_left([[1.0, 0.0]])[0] for s in (0.0, soft)]
    assert ways == pytest.approx([8.0, 8.0 * 0.5 * (1.0 + TIGHT)], rel=0.04)


def test_a_wide_door_is_worth_a_detour_where_clearance_is_asked_for():
    doors = map_of([[3.0, -6.0], [3.0, -3.2]], [[3.0, -1.2], [3.0, -0.3]], [[3.0, 0.3], [3.0, 6.0]])
    through = {}
    for clearance in (0.0, 0.5):
        finder = Wayfinder(Route(clearance=clearance, ahead=100.0), LIMITS)
        finder.follow(0.0, POSE, GOAL, doors, ())
        at = POSE[:2]
        while at[0] < 3.0:
            at = at + 0.05 * finder._field.direction(at)[0]
        through[clearance] = float(at[1])
    assert abs(through[0.0]) < 0.1
    assert -3.0 < through[0.5] < -1.4


def test_who_stands_long_enough_is_planned_around_and_who_walks_is_not():
    finder = Wayfinder(Route(), LIMITS)
    for k in range(60):
        now, people = 0.1 * k, [standing(2.0, 0.0), standing(4.0, 0.1 * k, (0.0, 1.0), "person1")]
        finder.follow(now, POSE, GOAL, EMPTY, people)
        straight = finder._field.way_left([[0.0, 0.0]])[0] == 6.0
        assert straight == (now < STOOD - 1e-9), now
    (event,) = finder.take_events()
    assert (event.name, event.text) == ("route", "planned again, around people who stand")
    finder.follow(7.0, POSE, GOAL, EMPTY, ())
    assert finder._field.way_left([[0.0, 0.0]])[0] == 6.0


def test_without_progress_the_robot_turns_to_the_way_then_waits_and_the_log_says_so():
    finder, away = Wayfinder(Route(patience=2.0), LIMITS), np.array([0.0, 0.0, 2.0])
    drive = Decision(0.5, 0.1, Status.OK)
    hows = []
    for k in range(100):
        finder.follow(0.1 * k, away, GOAL, EMPTY, ())
        hows.append((finder.recovered(drive, away).v, finder.recovered(drive, away).omega))
    turning, waiting = (0.0, -0.5 * LIMITS.max_turn_rate), (0.0, 0.0)
    assert hows[:20] == [(0.5, 0.1)] * 20
    assert hows[20:50] == [turning] * round(10 * RECOVERY)
    assert hows[70:99] == [waiting] * 29
    assert [event.text for event in finder.take_events()] == [
        "no progress for 2 s: the robot recovers (turn)",
        "no progress for 2 s: the robot recovers (wait)",
    ]


def test_a_recovery_by_turning_ends_where_the_robot_heads_along_the_way():
    finder = Wayfinder(Route(patience=1.0), LIMITS)
    for k in range(15):
        finder.follow(0.1 * k, np.array([0.0, 0.0, 0.1]), GOAL, EMPTY, ())
    assert finder.recovered(Decision(0.5, 0.0, Status.OK), POSE).v == 0.5


@pytest.mark.parametrize("method", ["dwa", "rkhs", "rkhs-plan"])
def test_a_door_in_which_somebody_stands_is_left_for_the_next_one(method):
    result = mjnav.run(loads(TWO_DOORS, ["route.planner=shortest", f"control.method={method}"]))
    assert result.summary["outcome"] == "goal"
    at_wall = np.abs(result.trajectory.robot_pose[:, 0] - 3.0).argmin()
    assert -2.6 < result.trajectory.robot_pose[at_wall, 1] < -1.4


@pytest.mark.parametrize("method", ["rkhs", "rkhs-plan"])
def test_without_a_way_that_door_is_the_end(method):
    assert mjnav.run(loads(TWO_DOORS, [f"control.method={method}"])).summary["outcome"] != "goal"


def test_a_run_with_a_way_replays_to_the_last_bit(tmp_path):
    log = tmp_path / "way.mcap"
    mjnav.run(loads(TWO_DOORS, ["route.planner=shortest", "time_limit=5"]), log=log)
    assert mjnav.replay(log).identical


IN_THE_WAY = """
schema = 1
name = "stuck"
time_limit = 4.0
robot = { start = [0.0, 0.0, 0.0], goal = [4.0, 0.0] }
walls = [{ from = [-1.0, 0.6], to = [5.0, 0.6] }, { from = [-1.0, -0.6], to = [5.0, -0.6] }]
route = { patience = 1.0 }
physics = { engine = "kinematic" }
[[people]]
start = [1.2, 0.0]
behaviour = "constant_velocity"
velocity = [0.0, 0.0]
"""


def test_a_recovery_is_no_command_beyond_the_limits(tmp_path):
    log = tmp_path / "stuck.mcap"
    result = mjnav.run(loads(IN_THE_WAY), log=log, detour=True)
    opened = mjnav.open_log(log)
    decisions = [message.value for message in opened.messages("/decision")]
    assert 5 < sum("recovery" in decision and "wish" in decision for decision in decisions) < len(decisions)
    assert result.summary["clipped_ticks"] == opened.trajectory().clipped_ticks == 0
    assert "clipped" not in {message.value.name for message in opened.messages("/events")}
    assert mjnav.replay(log).identical  # which is not asked for the detour


def test_a_clearance_below_zero_is_refused():
    with pytest.raises(InvalidValue, match="a number from 0 to 5 m"):
        Route(clearance=-1.0)
