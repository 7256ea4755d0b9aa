"""What must be true of each kind of method: weighted, matching, constrained; which obstacles count; statuses."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control import Status, make_controller, names
from mjnav.control.base import ConstrainedController
from mjnav.control.methods.cvar import Cvar
from mjnav.control.methods.dwa import Dwa
from mjnav.control.methods.gaussian_linearised import GaussianLinearised
from mjnav.control.methods.kld import Kld
from mjnav.control.methods.mmd_dirac import MmdDirac
from mjnav.control.methods.mppi import Mppi
from mjnav.control.methods.orca import Orca
from mjnav.control.planner import Planner
from mjnav.messages import ObstacleSamples, RobotLimits, Scan


def disc(x, y, radius=0.3):
    return ObstacleSamples(np.array([[x, y]]), np.zeros((1, 2)), radius)


def test_a_robot_at_rest_that_faces_away_from_its_goal_turns(alone, limits):
    for name in ("mean", "rkhs"):
        for heading in (3.0, -3.0, np.pi, 2.0):
            decision = make_controller(name, limits, 0.1, turn_change_weight=0.01).decide(
                alone(twist=(0.0, 0.0), heading=heading)
            )
            assert abs(decision.omega) == pytest.approx(0.3)  # all that one period allows
            if abs(heading) < np.pi:
                assert np.sign(decision.omega) == -np.sign(heading)


def test_a_robot_without_obstacles_drives_to_its_goal(choosing, alone):
    if isinstance(choosing, Cvar | Dwa | GaussianLinearised | Kld | MmdDirac):  # by their own weight 0.52 to 0.56
        parameters = replace(choosing.parameters, speed_change_weight=0.01)
        choosing = type(choosing)(choosing.limits, choosing.period, parameters)
    decision = choosing.decide(alone())
    assert decision.status == Status.OK
    if getattr(choosing.parameters, "window", "reachable") == "bounds":
        assert decision.v > 0.4, "as much as its own cost of a change asks for"
    else:
        assert decision.v == pytest.approx(0.6)
    assert abs(decision.omega) < 0.1


def test_the_status_says_when_no_candidate_meets_the_constraints(controller, alone):
    decision = controller.decide(alone(obstacles=(disc(0.1, 0.0, radius=3.0),)))
    own = isinstance(
        controller, ConstrainedController | Dwa | Mppi | Orca | Planner
    )  # a method with a constraint of its own reports that
    own &= getattr(controller.parameters, "penalty", np.inf) == np.inf
    assert decision.status == (Status.INFEASIBLE if own else Status.INFEASIBLE_NOMINAL)
    assert decision.status.advice


@pytest.mark.parametrize("name", names())
def test_the_status_says_when_the_robot_stands_and_stays(alone, limits, name):
    free = {"speed_change_weight": 0.0} if name != "orca" else {}  # which has no cost of a change
    controller = make_controller(name, limits, 0.1, **free)
    at_goal = alone(twist=(0.0, 0.0), goal=(0.0, 0.0))
    decision = controller.decide(at_goal)
    assert (decision.v, decision.omega, decision.status) == (0.0, 0.0, Status.STOPPED)
    moving = controller.decide(replace(at_goal, twist=np.array([0.05, 0.0])))
    assert (moving.v, moving.omega, moving.status) == (0.0, 0.0, Status.OK)  # it stops, but does not stand yet


@pytest.mark.parametrize("name", names())
def test_no_method_looks_at_scans(observe, limits, name):
    without = observe(seed=3, far=4.0)
    seen = replace(without, scan=Scan(0.0, np.linspace(-1.0, 1.0, 9), np.full(9, 0.3)))
    blind, sighted = (make_controller(name, limits, 0.1).decide(o) for o in (without, seen))
    assert (blind.v, blind.omega, blind.status) == (sighted.v, sighted.omega, sighted.status)


@pytest.mark.parametrize(
    ("name", "scenes"),
    [
        (
            "gaussian-linearised",
            [{"seed": seed, "far": 5.0, "num_walls": seed % 2} for seed in range(40)],
        ),
        *((name, [{"seed": seed, "far": 4.0} for seed in range(30)]) for name in ("cvar", "gaussian-moments", "saa")),
    ],
)
def test_a_constrained_method_takes_the_least_excess_where_nothing_is_allowed(observe, name, scenes):
    limits = RobotLimits(
        max_speed=1.1, min_speed=-0.2, max_turn_rate=1.4, max_acceleration=1.5, max_turn_acceleration=4.0
    )
    seen = set()
    for scene in scenes:
        controller = make_controller(name, limits, 0.2, num_v=4, num_omega=5, penalty=np.inf)
        decision = controller.decide(observe(near=0.5, **scene))
        costs, bound = decision.costs, controller.bound
        excess = np.maximum(costs.cone - bound, 0.0).sum(axis=1) + np.maximum(costs.lane - bound, 0.0).sum(axis=1)
        best = int(np.argmin(costs.total))
        assert (decision.status == Status.INFEASIBLE) == (excess.min() > 0.0)
        assert excess[best] == pytest.approx(excess.min(), rel=1e-8)
        assert costs.goal[best] == costs.goal[excess <= excess.min() * (1.0 + 1e-10)].min()
        seen.add(decision.status)
    assert {Status.INFEASIBLE, Status.OK} <= seen


@pytest.mark.parametrize("name", ["cvar", "gaussian-linearised", "gaussian-moments", "saa"])
def test_a_penalty_charges_what_exceeds_the_bound_and_a_large_one_forbids_it(observe, name):
    charging, severe, forbidding = (
        make_controller(name, RobotLimits(min_speed=-0.2), 0.2, num_v=4, num_omega=5, penalty=penalty)
        for penalty in (0.3, 1e6, np.inf)
    )
    differ = 0
    for seed in range(20):
        o = observe(seed, near=0.5, far=4.0)
        costs, bound = charging.decide(o).costs, charging.bound
        excess = sum(np.maximum(risk - bound, 0.0).sum(axis=1) for risk in (costs.cone, costs.lane))
        assert costs.total == pytest.approx(costs.goal + 0.3 * excess, rel=1e-12)
        chosen, decided = forbidding.decide(o), severe.decide(o)
        if excess.min() == 0.0:
            assert (decided.v, decided.omega) == (chosen.v, chosen.omega)
        else:
            assert decided.status != Status.INFEASIBLE == chosen.status
        differ += (charging.decide(o).v, charging.decide(o).omega) != (chosen.v, chosen.omega)
    assert differ


def test_the_closest_obstacles_samples_are_those_of_the_decision(observe, limits):
    o = observe(7, num_obstacles=4)
    gaps = [np.hypot(*(d.position.mean(0) - o.robot_pose[:, :2].mean(0))) - d.radius for d in o.obstacles]
    for name in names():
        controller = make_controller(name, limits, 0.1)
        found = controller.closest_cone(o, controller.decide(o))
        assert found is not None
        index, samples, desired = found
        assert index == np.argmin(gaps)
        assert samples.shape == (5 * len(o.obstacles[index].position),)
        assert (desired <= 0.0).all()
        assert controller.closest_cone(replace(o, obstacles=()), controller.decide(o)) is None
