"""The kernel against a literal rollout of one plan, and the plans against the robot's limits."""

import numpy as np
import pytest

from mjnav.geometry.distances import segment_distance
from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import WayField, WayGrid
from mjnav.messages import RobotLimits
from mjnav.metrics.oracle.rollouts import KNOT, KNOTS, Base, Bodies, Way, first_clear, plans
from mjnav.motion.unicycle import command_bounds, integrate, ramp_mean

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
