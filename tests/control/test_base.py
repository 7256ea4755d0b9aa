"""What must be true of each kind of method: weighted, matching, constrained; which obstacles count; statuses."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control import Status, make_controller, names
from mjnav.control.base import ConstrainedController
from mjnav.control.methods.dwa import Dwa
from mjnav.control.methods.mppi import Mppi
from mjnav.control.methods.orca import Orca
from mjnav.messages import Lanes, ObstacleSamples, RobotLimits

SMALL = {"num_v": 6, "num_omega": 7}
OTHERS = {"mppi": {"rollouts": 40}, "orca": {}}  # these choose from candidates of their own, or from none


@pytest.fixture(params=names())
def controller(request, limits):
    return make_controller(request.param, limits, 0.1, **OTHERS.get(request.param, SMALL))


@pytest.fixture(params=[name for name in names() if name not in OTHERS])
def choosing(request, limits):
    """A method that chooses from the grid of candidates."""
    return make_controller(request.param, limits, 0.1, **SMALL)


def disc(x, y, radius=0.3):
    return ObstacleSamples(np.array([[x, y]]), np.zeros((1, 2)), radius)


@pytest.mark.parametrize("name", ["rkhs", "rkhs-paper", "kld"])
def test_matching_costs_nothing_at_a_nominal_control_whose_samples_are_all_safe(observe, limits, name):
    controller = make_controller(name, limits, 0.1, **SMALL, desired_min=0)
    checked = 0
    for seed in range(12):
        o = observe(seed, near=2.0, far=6.0, lanes=False)
        problem = controller.problem(o)
        c, costs = problem.candidates, controller.evaluate(problem)
        for block, column in enumerate(problem.cone.blocks.column):
            samples = problem.cone.samples(block, c.v[[problem.nominal]], c.omega[[problem.nominal]])[:, 0]
            if (samples <= 0.0).all():
                size = 1.0 + np.abs(samples).max() ** (2 * getattr(controller.parameters, "degree", 1))
                assert costs.cone[problem.nominal, column] == pytest.approx(0.0, abs=1e-9 * size)
                checked += 1
    assert checked >= 12


# A share of samples does not say by how much the mean's control violates: where all do, `saa` chooses another one.
@pytest.mark.parametrize(
    ("name", "key", "values"),
    [
        ("cvar", "eta", (0.0, 0.5, 0.95, 1.0)),
        ("saa", "eta", (0.1, 0.9, 1.0)),
        ("gaussian-linearised", "delta", (1e-6, 0.05, 0.5)),
        ("gaussian-moments", "eta", (0.5, 0.99)),
        ("gaussian-moments", "tail", ("cantelli", "quantile")),
    ],
)
def test_without_uncertainty_a_constrained_method_decides_as_the_mean_does(observe, certain, limits, name, key, values):
    agreed = set()
    for seed in range(20):
        o = certain(observe(seed, num_walls=seed % 3, **({"near": 0.05, "far": 2.5} if seed % 2 else {})))
        mean = make_controller("mean", limits, 0.1).decide(o)
        for value in values:
            decision = make_controller(name, limits, 0.1, **{key: value}).decide(o)
            if mean.status == Status.INFEASIBLE_NOMINAL:
                assert decision.status == Status.INFEASIBLE
            else:
                assert (decision.v, decision.omega, decision.status) == (mean.v, mean.omega, mean.status)
            agreed.add(decision.status)
    assert {Status.OK, Status.INFEASIBLE} <= agreed


@pytest.mark.parametrize("degree", [1, 3])
def test_without_uncertainty_a_heavy_risk_leaves_the_nominal_control(alone, limits, degree):
    rng = np.random.default_rng(degree)
    checked = 0
    for _ in range(30):
        angle, distance = rng.uniform(-1.5, 1.5), rng.uniform(1.2, 4.0)
        place = distance * np.array([np.cos(angle), np.sin(angle)])
        disc = ObstacleSamples(place[None], rng.normal(scale=0.5, size=(1, 2)) - 0.5 * place[None] / distance, 0.3)
        o = alone(obstacles=(disc,))
        light, heavy = (make_controller("rkhs", limits, 0.1, degree=degree, weight=w).decide(o) for w in (0.0, 1e6))
        if heavy.status != Status.OK:
            continue
        assert light.costs.total.min() <= heavy.costs.goal[heavy.costs.nominal]
        assert (heavy.v, heavy.omega) == (heavy.costs.v[heavy.costs.nominal], heavy.costs.omega[heavy.costs.nominal])
        checked += light.v != heavy.v or light.omega != heavy.omega
    assert checked >= 3  # the risk made a difference


@pytest.mark.parametrize("name", ["rkhs", "rkhs-paper", "kld", "mmd-dirac"])
def test_without_risk_weight_only_the_goal_counts(observe, limits, name):
    decision = make_controller(name, limits, 0.1, **SMALL, weight=0.0, lane_weights=(0.0, 0.0)).decide(observe(5))
    assert (decision.costs.total == decision.costs.goal).all()


def test_obstacles_out_of_range_or_beyond_the_number_have_columns_of_zeros(observe, limits):
    o = observe(6, num_obstacles=5, far=6.5, num_walls=0)
    gaps = [np.hypot(*(d.position.mean(0) - o.robot_pose[:, :2].mean(0))) - d.radius for d in o.obstacles]
    nearest = np.argsort(gaps)

    def seen(**parameters):
        return set(
            np.flatnonzero(make_controller("rkhs", limits, 0.1, clip=np.inf, **parameters).decide(o).costs.cone.any(0))
        )

    assert seen() == set(range(5))
    for number in (1, 2, 4):
        assert seen(max_obstacles=number) == set(nearest[:number])
    middle = 0.5 * (gaps[nearest[2]] + gaps[nearest[3]])
    assert seen(sensing_range=middle) == set(nearest[:3])


def test_the_distance_of_an_obstacle_is_that_of_its_surface(alone, limits):
    def disc(x, radius):
        return ObstacleSamples(np.array([[x, 0.0]]), np.zeros((1, 2)), radius)

    o = alone(obstacles=(disc(-2.0, 0.1), disc(3.0, 1.5)))
    for parameters in ({"max_obstacles": 1}, {"sensing_range": 1.7}):
        controller = make_controller("rkhs", limits, 0.1, clip=np.inf, **parameters)
        assert controller.decide(o).costs.cone.any(axis=0).tolist() == [False, True]


@pytest.mark.parametrize("name", ["rkhs", "dwa", "mppi"])
def test_walls_have_the_columns_after_the_obstacles_and_what_is_far_is_zero(alone, limits, name):
    walls = np.array([[[-9.0, -1.0], [-9.0, 1.0]], [[1.4, -3.0], [1.4, 3.0]]])
    o = alone(obstacles=(disc(9.0, 0.0), disc(1.2, 0.0)), walls=walls)
    cone = make_controller(name, limits, 0.1).decide(o).costs.cone
    assert cone.any(axis=0).tolist() == [False, True, False, True]


def test_a_robot_at_rest_that_faces_away_from_its_goal_turns(alone, limits):
    for name in ("mean", "rkhs"):
        for heading in (3.0, -3.0, np.pi, 2.0):
            decision = make_controller(name, limits, 0.1).decide(alone(twist=(0.0, 0.0), heading=heading))
            assert abs(decision.omega) == pytest.approx(0.3)  # all that one period allows
            if abs(heading) < np.pi:
                assert np.sign(decision.omega) == -np.sign(heading)


def test_a_robot_without_obstacles_drives_to_its_goal(choosing, alone):
    decision = choosing.decide(alone())
    assert decision.status == Status.OK
    assert decision.v == pytest.approx(0.6)
    assert abs(decision.omega) < 0.1


def test_between_lanes_a_robot_near_the_left_one_turns_right(alone, limits):
    zero = np.zeros(25)
    lanes = Lanes((0.0, 1.0, -0.25), (0.0, 1.0, 2.0), zero, zero)
    for name in ("mean", "mppi", "rkhs"):
        decision = make_controller(name, limits, 0.1).decide(alone(heading=0.1, goal=(5.0, 1.0), lanes=lanes))
        assert decision.omega < 0.0


def test_the_status_says_when_no_candidate_meets_the_constraints(controller, alone):
    decision = controller.decide(alone(obstacles=(disc(0.1, 0.0, radius=3.0),)))
    own = isinstance(
        controller, ConstrainedController | Dwa | Mppi | Orca
    )  # a method with a constraint of its own reports that
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
        controller = make_controller(name, limits, 0.2, num_v=4, num_omega=5)
        decision = controller.decide(observe(near=0.5, **scene))
        costs, bound = decision.costs, controller.bound
        excess = np.maximum(costs.cone - bound, 0.0).sum(axis=1) + np.maximum(costs.lane - bound, 0.0).sum(axis=1)
        best = int(np.argmin(costs.total))
        assert (decision.status == Status.INFEASIBLE) == (excess.min() > 0.0)
        assert excess[best] == pytest.approx(excess.min(), rel=1e-8)
        assert costs.goal[best] == costs.goal[excess <= excess.min() * (1.0 + 1e-10)].min()
        seen.add(decision.status)
    assert {Status.INFEASIBLE, Status.OK} <= seen


def test_every_status_but_ok_carries_advice():
    assert Status.OK.advice == ""
    assert all(len(status.advice) > 10 for status in Status if status != Status.OK)


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


@pytest.mark.parametrize("name", ["mppi", "orca"])
def test_a_method_without_a_cone_of_its_own_is_logged_by_the_default_one(observe, limits, name):
    o = observe(7, num_obstacles=4)
    own, other = (make_controller(method, limits, 0.1, safety_margin=0.1) for method in (name, "cvar"))
    decision = own.decide(o)
    assert own.closest_cone(o, decision)[1].tobytes() == other.closest_cone(o, decision)[1].tobytes()
