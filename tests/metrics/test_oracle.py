"""The oracle: exact small answers from runs that are made up, its kernel against a literal rollout, and its plans."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.geometry.distances import segment_distance
from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import WayField, WayGrid
from mjnav.messages import Contact, RobotLimits
from mjnav.metrics.oracle import (
    KNOT,
    KNOTS,
    Base,
    Bodies,
    Foreknown,
    Way,
    first_clear,
    judged,
    plans,
    true_paths,
)
from mjnav.motion.unicycle import command_bounds, integrate, ramp_mean
from mjnav.scene.spec import Wall
from tests.metrics.conftest import make_scenario, make_trajectory

ROWS = 31  # 3 s
TIMES = 0.1 * np.arange(ROWS)
BOX = tuple(  # walls around the origin that leave the robot of 0.25 m 5 cm on each side
    Wall(start, end, thickness=0.1)
    for start, end in (
        ((-0.35, -0.4), (-0.35, 0.4)), ((0.35, -0.4), (0.35, 0.4)), ((-0.4, -0.35), (0.4, -0.35)),
        ((-0.4, 0.35), (0.4, 0.35)),
    )
)  # fmt: skip


def standing(*, people=None, **changes):
    return make_trajectory(np.zeros((ROWS, 2)), people=people, **changes)


def robot(scenario, **limits):
    return replace(scenario, robot=replace(scenario.robot, **limits))


@pytest.mark.parametrize(
    ("acceleration", "avoidable", "last"),
    [
        (2.10, (True, True), 0.5),  # 0.476 s at 2 m/s are what braking takes, and a tick is 0.1 s
        (1.02, (True, True), 1.0),
        (0.98, (True, False), 1.1),
        (0.52, (True, False), 2.0),
        (0.48, (False, False), None),
    ],
)
def test_a_wall_straight_ahead_is_avoidable_where_braking_takes_less_than_the_way_to_it(acceleration, avoidable, last):
    """At 2 m/s the wall is 2 m away 1 s before the contact, and braking takes v^2 / (2 a)."""
    trajectory = make_trajectory(
        np.column_stack([2.0 * TIMES, np.zeros(ROWS)]),
        robot_twist=np.tile([2.0, 0.0], (ROWS, 1)),
        contacts=(Contact("wall", "wall0", 0.0, TIMES[-1]),),
    )
    wall = Wall((6.3, -50.0), (6.3, 50.0), thickness=0.1)  # its face is 0.25 m beyond where the robot ends
    scenario = robot(
        make_scenario(goal=(20.0, 0.0), walls=(wall,)), max_speed=2.0, max_turn_rate=0.01, max_acceleration=acceleration
    )
    found = judged(trajectory, scenario, outcome="collision").collision
    assert found is not None
    assert found.avoidable == avoidable
    assert found.last_chance == (None if last is None else pytest.approx(last))
    assert found.touch is None


def test_people_go_straight_on_behind_the_last_state_and_are_nowhere_while_they_are_away():
    people = np.array([[[0.0, 0.0], [5.0, 5.0]], [[0.1, 0.0], [np.nan] * 2], [[0.3, 0.0], [7.0, 7.0]]])
    trajectory = make_trajectory(
        np.zeros((3, 2)), people=people, people_velocity=np.tile([[1.0, 2.0], [0.0, 0.0]], (3, 1, 1))
    )
    found = true_paths(trajectory, np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.7]))
    np.testing.assert_allclose(found[:, 0], [[0, 0], [0.05, 0], [0.1, 0], [0.2, 0], [0.3, 0], [0.8, 1]], atol=1e-12)
    np.testing.assert_array_equal(np.isnan(found[:, 1, 0]), [False, True, True, True, False, False])
    early = true_paths(trajectory, np.array([0.1, 0.2]), until=0)
    np.testing.assert_allclose(early[:, 0], [[0.1, 0.2], [0.2, 0.4]], atol=1e-12)


def test_at_rest_a_way_is_free_in_the_open_and_not_between_four_walls():
    for walls, free in (((), 3.0), (BOX, 0.0)):
        found = judged(standing(), make_scenario(walls=walls), outcome="timeout")
        assert (found.stalled, found.free) == (pytest.approx(3.0), pytest.approx(free))


@pytest.mark.parametrize(("goal", "avoidable"), [(2.6, True), (2.8, False)])
def test_a_time_out_is_avoidable_if_the_free_time_at_rest_is_enough_for_the_way_left(goal, avoidable):
    """3 s at the preferred 0.8 m/s are 2.4 m, and the goal is reached 0.3 m before it."""
    scenario = make_scenario(goal=(goal, 0.0))
    assert judged(standing(), scenario, outcome="timeout").timeout is avoidable
    assert judged(standing(), scenario, outcome="collision").timeout is None


def test_the_bottom_of_a_dead_end_is_no_way_to_a_goal_behind_it():
    """The robot could drive 0.5 m straight towards its goal, and its way out is blocked."""
    sides = tuple(Wall((-2.0, y), (1.0, y)) for y in (-0.5, 0.5))
    scenario = make_scenario(num_people=1, walls=(*sides, Wall((1.0, -0.5), (1.0, 0.5))))
    blocked = standing(people=np.tile([-0.7, 0.0], (ROWS, 1, 1)))
    assert judged(blocked, scenario, outcome="timeout").free == 0.0
    open_end = replace(scenario, walls=sides)
    assert judged(blocked, open_end, outcome="timeout").free == pytest.approx(3.0)


def test_a_newcomer_counts_only_once_the_robot_has_left_the_place():
    people = np.tile([0.1, 0.0], (ROWS, 1, 1))
    people[:10] = np.nan
    known = Foreknown(standing(people=people), make_scenario(num_people=1))
    assert known.first_clear_plan(0, 2.0) == 0  # stands where the newcomer would have waited
    assert known.first_clear_plan(10, 2.0) is not None  # from an overlap nobody may come nearer


# ------------------------------------------------------------------------------ plans and their rollouts

LIMITS = RobotLimits(min_speed=-0.5)
STEP, STEPS = 0.1, 30
NOTHING = Floor(np.zeros((0, 3)), np.zeros((0, 6)))


def straight_to(x: float, y: float) -> WayGrid:
    return WayField.of(NOTHING, (x, y), 0.2).grid


def literal(pose, twist, plan):
    """Centres of the robot under one plan, (STEPS + 1, 2)."""
    path = [pose]
    for k in range(STEPS):
        mean, twist = ramp_mean(twist, plan[int(k * STEP / KNOT + 1e-9)], LIMITS, STEP)
        path.append(integrate(path[-1], mean[0], mean[1], STEP))
    return np.array(path)[:, :2]


def is_clear(pose, twist, plan, base, bodies, way):
    plan = plan[None].copy()
    plan.flags.writeable = False  # as the oracle's are: one kernel is compiled
    return first_clear(pose, twist, plan, base, bodies, way) == 0


def test_a_plan_is_clear_where_a_literal_rollout_touches_nothing():
    rng, verdicts = np.random.default_rng(1), []
    base = Base(LIMITS.max_acceleration, LIMITS.max_turn_acceleration, 1.0, STEP, round(KNOT / STEP), STEPS)
    way = Way(straight_to(9.0, 0.0), np.array([[9.0, 0.0]]), np.zeros(1), 0.3, np.inf)
    for _ in range(6):
        pose, twist = np.array([0.0, 0.0, rng.uniform(-3, 3)]), np.array([rng.uniform(-0.3, 1.0), rng.uniform(-1, 1)])
        away = rng.uniform(-3, 3, 2)
        start = rng.uniform(0.9, 2.0, (2, 1)) * np.column_stack([np.cos(away), np.sin(away)])
        people = start + rng.uniform(-1, 1, (2, 2)) * STEP * np.arange(STEPS + 1)[:, None, None]
        disc, angle = np.array([*rng.uniform(0.5, 1.5, 2), 0.1]), rng.uniform(0, 3)
        box = np.array([*rng.uniform(-2.0, -0.9, 2), np.cos(angle), np.sin(angle), 0.4, 0.05])
        bodies = Bodies(people, np.full(2, 0.4), disc[None], box[None], 0.2)
        for plan in plans(LIMITS)[rng.choice(len(plans(LIMITS)), 30)]:
            path = literal(pose, twist, plan)
            relative = people - path[:, None]
            to_people = segment_distance(np.zeros(2), relative[:-1], relative[1:]) - 0.4
            to_disc = segment_distance(disc[:2], path[:-1], path[1:]) - disc[2] - 0.2
            fine = path[:-1, None] + np.linspace(0, 1, 50)[:, None] * (path[1:] - path[:-1])[:, None]
            to_box = Floor(np.zeros((0, 3)), box[None]).clearance(fine) - 0.2
            least = min(to_people.min(), to_disc.min(), to_box.min())
            if abs(least) > 1e-3:
                assert is_clear(pose, twist, plan, base, bodies, way) == (least > 0.0)
                verdicts.append(least > 0.0)
    assert 40 < sum(verdicts) < len(verdicts) - 40  # both came up


def test_a_plan_that_has_to_make_way_is_taken_only_where_it_does():
    base = Base(1.0, 3.0, 1.0, STEP, round(KNOT / STEP), STEPS)
    nobody = Bodies(np.zeros((STEPS + 1, 0, 2)), np.zeros(0), np.zeros((0, 3)), np.zeros((0, 6)), 0.2)
    ahead, pose, twist = np.tile([1.0, 0.0], (KNOTS, 1)), np.zeros(3), np.zeros(2)
    for left, expected in ((6.0 - 2.5 + 1e-6, True), (6.0 - 2.5 - 1e-6, False)):  # from rest 2.5 m in 3 s at 1 m/s^2
        way = Way(straight_to(6.0, 0.0), np.array([[6.0, 0.0]]), np.zeros(1), 0.3, left)
        assert is_clear(pose, twist, ahead, base, nobody, way) is expected
        assert not is_clear(pose, twist, np.zeros_like(ahead), base, nobody, way)
    # It passes the first point, and goes on straight instead of to the second.
    corner = straight_to(1.0, 0.0), np.array([[1.0, 0.0], [1.0, 5.0]]), np.array([5.0, 0.0]), 0.3
    for left, expected in ((5.2, False), (5.3, True)):  # hypot(1.5, 5) = 5.22
        assert is_clear(pose, twist, ahead, base, nobody, Way(*corner, left)) is expected
    reached = Way(straight_to(2.0, 0.0), np.array([[2.0, 0.0]]), np.zeros(1), 0.3, 0.0)
    assert is_clear(pose, twist, ahead, base, nobody, reached)


@pytest.mark.parametrize(("low", "turn"), [(0.0, 1.5), (-0.5, 0.2), (0.3, 4.0)])
def test_plans_are_within_what_the_base_takes_and_the_same_every_time(low, turn):
    limits = RobotLimits(min_speed=low, max_turn_rate=turn)
    found, (bottom, top) = plans(limits), command_bounds(limits)
    assert (found.min(axis=(0, 1)) == bottom).all()
    assert (found.max(axis=(0, 1)) == top).all()
    assert (found[0] == 0.0).all()
    plans.cache_clear()
    np.testing.assert_array_equal(plans(limits), found)
