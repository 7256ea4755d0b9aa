"""What a planner weighs and which way it goes: cost and feasibility, against both written out in plain Python."""

from math import comb, cos, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.control import Status, make_controller
from mjnav.control.planner import effort
from mjnav.control.problem.fan import SECOND, led, moves, num_rollouts
from mjnav.control.rollouts import ControlLimits, Rollouts
from mjnav.geometry.floor import Floor
from mjnav.geometry.way_field import WayField
from mjnav.messages import KnownMap, ObstacleSamples, RobotLimits
from mjnav.metrics.effort import control_cost
from mjnav.motion.unicycle import integrate

STEP = 0.2
BACK = RobotLimits(min_speed=-0.6, max_acceleration=0.9)
EMPTY = Floor(np.zeros((0, 3)), np.zeros((0, 6)))
CROWDED = {"spread": 0.15, "near": 0.4, "far": 2.0, "num_samples": 7}

# ------------------------------------------------------------------------------------------ the rollouts


def driven_by(rows, heading, goal, limits, steps=20, twist=(0.0, 0.0)):
    """The rollouts of moves from the origin, and the same controls brought within the limits and driven anew."""
    within = ControlLimits.of(np.array(twist), limits, 0.1, STEP)
    way = WayField.of(EMPTY, goal, 0.25).grid
    rollouts = led(rows, np.array([0.0, 0.0, heading]), way, within, 0.8, 1.0, 0.4, STEP, steps)
    return rollouts, Rollouts.of(rollouts.controls, heading, within, STEP)


@settings(max_examples=30)
@given(
    st.floats(-pi, pi), st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    st.tuples(st.floats(0.0, 1.0), st.floats(-1.5, 1.5)), st.sampled_from([RobotLimits(), BACK]),
)  # fmt: skip
def test_every_rollout_is_within_the_limits_and_there_are_as_many_as_are_counted(heading, goal, twist, limits):
    rows = moves(limits, np.array(twist), 0.8, 3, 5, 0.6)
    assert len(rows) == num_rollouts(3, 5, reverses=limits is BACK)
    rollouts, driven = driven_by(rows, heading, goal, limits, twist=twist)
    for part in ("controls", "x", "y", "heading", "direction"):
        assert np.abs(getattr(driven, part) - getattr(rollouts, part)).max() < 1e-12
    poses = np.tile([0.0, 0.0, heading], (len(rows), 1))
    for v, omega in rollouts.controls.swapaxes(0, 1):
        poses = integrate(poses, v, omega, STEP)
    ends = np.array([rollouts.x[-1], rollouts.y[-1], *rollouts.direction[:, -1]])
    expected = np.array([poses[:, 0], poses[:, 1], np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    assert np.abs(ends - expected).max() < 1e-12


@pytest.mark.parametrize("turn_rate", [2.4, 2.6, 30.0])  # within the series, and beyond
def test_rollouts_are_exact_arcs_at_any_turn_rate(turn_rate):
    quick = RobotLimits(max_turn_rate=turn_rate, max_turn_acceleration=1e3, max_acceleration=1e3)
    wanted = np.tile([[[0.7]], [[turn_rate]]], (1, 20, 1))
    driven = Rollouts.of(wanted, 0.4, ControlLimits.of(np.array([0.7, turn_rate]), quick, 0.1, STEP), STEP)
    expected = integrate(np.array([0.0, 0.0, 0.4]), 0.7, turn_rate, 20 * STEP)
    found = driven.x[-1, 0], driven.y[-1, 0], *driven.direction[:, -1, 0]
    assert found == pytest.approx([*expected[:2], np.cos(expected[2]), np.sin(expected[2])], abs=1e-13)


def test_a_rollout_is_two_moves_and_then_the_way_to_the_goal():
    quick = RobotLimits(max_acceleration=100.0, max_turn_acceleration=100.0)
    rows = moves(quick, np.array([0.3, 0.2]), 0.8, 3, 7, 0.6)
    driven, _ = driven_by(rows, 0.5, (2.0, -1.0), quick, steps=60)
    num = len(SECOND)
    first = [(v, omega) for v in (0.0, 0.4, 0.8) for omega in np.linspace(-1.5, 1.5, 7)] + [(0.3, 0.2)]
    for a, move in enumerate(first):
        for b, (v, omega, lasting) in enumerate(SECOND):
            u = driven.controls[:, :, a * num + b].T
            assert u[:3] == pytest.approx(np.tile(move, (3, 1)))
            end = 3 + round(lasting / STEP)
            assert u[3:end] == pytest.approx(np.tile((0.8 * v, 1.5 * omega), (end - 3, 1)))
    ends = np.hypot(driven.x[-1] - 2.0, driven.y[-1] + 1.0)
    assert ends[:-2].max() < 0.05  # by 12 s all but who stands are at the goal
    assert (driven.controls[:, :, -2] == 0.0).all()
    assert ends[-1] < 0.01


# -------------------------------------------------------------------------------------------- the choice


def watch(controller):
    """The list of what it weighs."""
    weigh, watched = controller.weigh, []

    def watched_weigh(*given):
        watched.append(weigh(*given))
        return watched[-1]

    controller.weigh = watched_weigh
    return watched


def distance(violations, degree):
    """MMD of these to none."""
    moments = [sum(h**p for h in violations) / len(violations) for p in range(degree + 1)]
    return sqrt(sum(comb(degree, p) * moments[p] ** 2 for p in range(1, degree + 1)))


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_the_first_control_is_that_of_the_cheapest_feasible_rollout(observe, limits, degree):
    ruled_out, given = 0, {"num_turn_rates": 3, "degree": degree, "weight": 1.0, "risk_bound": 0.1}
    for seed in range(12):
        controller = make_controller("rkhs-plan", limits, 0.1, **given)
        watched = watch(controller)
        decision = controller.decide(observe(seed, **CROWDED))
        (weighed,) = watched
        h = weighed.risks.violation.tolist()
        cost = [goal + distance(h[k], degree) for k, goal in enumerate(weighed.goal.tolist())]
        feasible = [k for k in range(len(h)) if sum(x >= 1.0 for x in h[k]) <= 0.1 * len(h[k])]
        best = min(feasible or range(len(h)), key=lambda k: cost[k])
        assert (decision.v, decision.omega) == tuple(weighed.rollouts.controls[:, 0, best])
        assert (decision.status == Status.INFEASIBLE) == (not feasible)
        ruled_out += int(np.argmin(cost)) not in feasible
    assert ruled_out > 0


@pytest.mark.parametrize("method", ["mppi-plus", "rkhs-plan"])
def test_where_nothing_is_feasible_the_cheapest_is_followed(alone, limits, method):
    people = []
    for j in range(9):
        towards = np.array([cos(2.0 * pi * j / 9), sin(2.0 * pi * j / 9)])
        people.append(ObstacleSamples(np.tile(0.7 * towards, (4, 1)), np.tile(-0.8 * towards, (4, 1)), 0.3))
    controller = make_controller(method, limits, 0.1)
    watched = watch(controller)
    decision = controller.decide(alone(num_samples=4, twist=(0.0, 0.0), obstacles=people))
    assert decision.status == Status.INFEASIBLE
    assert not decision.plan.feasible
    k = np.argmin(watched[0].total)
    assert (decision.v, decision.omega) == tuple(watched[0].rollouts.controls[:, 0, k])


def test_effort_is_the_control_cost_of_the_metrics(limits):
    commands = np.random.default_rng(0).normal(size=(2, 5, 3))
    nowhere = np.zeros((5, 3))
    rollouts = Rollouts(commands, nowhere, nowhere, nowhere, commands, 0.2)
    found = effort(rollouts, np.zeros(2), 0.17)
    assert found == pytest.approx([control_cost(commands[:, :, k].T, 0.2) for k in range(3)])
    turned = effort(rollouts, commands[:, 0, 0], 0.17)  # of a robot that has the first command already
    assert turned[0] == pytest.approx(found[0] - control_cost(commands[:, :1, 0].T, 0.2))


def test_a_planner_with_a_map_goes_round_a_wall_before_which_it_stands_without(drive, limits):
    walls = np.array([[[1.5, -3.0], [1.5, 3.0]]])
    known = KnownMap(walls, np.array([0.0]), np.zeros((0, 3)))
    way = {"goal": (3.0, 0.0), "walls": walls, "seconds": 20.0}
    reached, clearance = drive(make_controller("rkhs-plan", limits, 0.1), known=known, **way)
    assert reached
    assert clearance > 0.0
    assert not drive(make_controller("rkhs-plan", limits, 0.1), **way)[0]
