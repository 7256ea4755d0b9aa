"""What must be true of every decision, whatever the numbers."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control.methods.rkhs_plan import RkhsPlan
from mjnav.messages import Lanes, ObstacleSamples
from mjnav.motion.unicycle import command_bounds, reachable

CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 9}
TERMS = ("v", "omega", "goal", "cone", "lane", "total")


def fresh(controller):
    """Another one, which has seen nothing."""
    return type(controller)(controller.limits, controller.period, controller.parameters)


def assert_decided_alike(controller, before, after, *, columns=slice(None)):
    a, b = controller.decide(before), fresh(controller).decide(after)
    assert (a.v, a.omega) == pytest.approx((b.v, b.omega), abs=1e-6)
    assert a.status == b.status
    if a.costs is None:
        return
    for term in ("goal", "cone", "lane", "total"):
        left, right = getattr(a.costs, term), getattr(b.costs, term)
        left = left[:, columns] if term == "cone" else left
        size = np.abs(left[np.isfinite(left)]).max(initial=1.0)
        assert left == pytest.approx(right, rel=1e-7, abs=1e-9 * size), term
    assert a.costs.nominal == b.costs.nominal


def turned(line, angle, shift):
    """The line a x + b y + c = 0 in a world turned by `angle` about the origin and then shifted."""
    a, b, c = line
    a, b = a * np.cos(angle) - b * np.sin(angle), a * np.sin(angle) + b * np.cos(angle)
    return (a, b, c - a * shift[0] - b * shift[1])


@pytest.mark.parametrize("seed", range(4))
def test_the_order_of_obstacles_and_of_each_beliefs_samples_changes_nothing(controller, observe, seed):
    o = observe(seed, num_samples=8, num_obstacles=4, num_walls=2, **({} if seed % 2 else {"near": 0.05, "far": 2.5}))
    rng = np.random.default_rng(seed)
    robot, order, discs = rng.permutation(8), rng.permutation(4), []
    joint = isinstance(controller, RkhsPlan)  # pairs samples by their order
    if joint:
        robot = np.arange(8)
    for j in order:
        rows = np.arange(len(o.obstacles[j].position)) if joint else rng.permutation(len(o.obstacles[j].position))
        discs.append(
            replace(o.obstacles[j], position=o.obstacles[j].position[rows], velocity=o.obstacles[j].velocity[rows])
        )
    lanes = replace(o.lanes, left_offset=o.lanes.left_offset[robot], right_offset=o.lanes.right_offset[robot])
    other = replace(
        o, robot_pose=o.robot_pose[robot], control_noise=o.control_noise[robot], obstacles=tuple(discs), lanes=lanes
    )
    assert_decided_alike(controller, o, other, columns=[*order, 4, 5])


@pytest.mark.parametrize("seed", range(8))
def test_a_turned_and_shifted_world_gives_the_same_decision(controller, observe, seed):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    rng = np.random.default_rng(seed)
    angle, shift = rng.uniform(-np.pi, np.pi), rng.normal(scale=20.0, size=2)
    rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])  # acts from the right
    other = replace(
        o,
        robot_pose=np.column_stack([o.robot_pose[:, :2] @ rotation + shift, o.robot_pose[:, 2] + angle]),
        obstacles=tuple(
            replace(disc, position=disc.position @ rotation + shift, velocity=disc.velocity @ rotation)
            for disc in o.obstacles
        ),
        goal=o.goal @ rotation + shift,
        walls=o.walls @ rotation + shift,
        lanes=replace(o.lanes, left=turned(o.lanes.left, angle, shift), right=turned(o.lanes.right, angle, shift)),
    )
    assert_decided_alike(controller, o, other)


@pytest.mark.parametrize(
    ("goal", "obstacle"), [((-4.0, 0.0), ()), ((6.0, 0.0), ((2.0, 0.0),))], ids=["goal behind", "obstacle ahead"]
)
def test_of_two_sides_that_are_equally_good_the_same_is_taken_whatever_the_last_bits(controller, alone, goal, obstacle):
    o, omegas = alone(twist=(0.4, 0.0), goal=goal, obstacles=[disc(*place) for place in obstacle]), []
    for heading in np.random.default_rng(0).uniform(-np.pi, np.pi, 20):
        rotation = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
        discs = tuple(replace(one, position=one.position @ rotation) for one in o.obstacles)
        turned = replace(
            o, robot_pose=o.robot_pose + np.array([0.0, 0.0, heading]), goal=o.goal @ rotation, obstacles=discs
        )
        omegas.append(fresh(controller).decide(turned).omega)
    assert omegas == pytest.approx([omegas[0]] * 20, abs=1e-6)


def test_the_same_observations_in_the_same_order_give_the_same_bits(controller, observe):
    other = fresh(controller)
    for tick in range(3):
        o = replace(observe(tick), time=0.1 * tick)
        a, b = controller.decide(o), other.decide(o)
        controller.closest_cone(o, a)  # the log's question does not change what is decided next
        assert (a.v, a.omega, a.status) == (b.v, b.omega, b.status)
        if a.costs is not None:
            assert all(getattr(a.costs, term).tobytes() == getattr(b.costs, term).tobytes() for term in TERMS)


@pytest.mark.parametrize("seed", range(10))
def test_the_decision_is_within_reach_and_every_cost_is_a_number(controller, observe, seed):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    decision = controller.decide(o)
    low, high = reachable(o.twist, controller.limits, controller.period)
    if getattr(controller.parameters, "window", "reachable") == "bounds":
        low, high = command_bounds(controller.limits)
    assert low[0] <= decision.v <= high[0]
    assert low[1] <= decision.omega <= high[1]
    if decision.costs is not None:
        assert all(np.isfinite(getattr(decision.costs, term)).all() for term in ("goal", "cone", "lane"))
        assert not np.isnan(decision.costs.total).any()


@pytest.mark.parametrize("seed", range(10))
def test_a_method_with_candidates_takes_the_cheapest(choosing, observe, seed):
    decision = choosing.decide(observe(seed, **(CROWDED if seed % 2 else {})))
    best = np.argmin(decision.costs.total)
    assert (decision.v, decision.omega) == (decision.costs.v[best], decision.costs.omega[best])
    assert np.isfinite(decision.costs.total[best])


def disc(x, y, radius=0.3):
    return ObstacleSamples(np.array([[x, y]]), np.zeros((1, 2)), radius)


POINT, INVERTED = np.zeros((1, 2, 2)), Lanes((0.0, 1.0, 1.0), (0.0, 1.0, -1.0), np.zeros(25), np.zeros(25))


@pytest.mark.parametrize(
    "fields",
    [
        {"num_samples": 1},
        {"twist": (0.0, 0.0)},
        {"twist": (9.0, -9.0)},
        {"goal": (0.0, 0.0)},
        {"obstacles": (disc(0.0, 0.0), disc(0.0, 0.0))},
        {"obstacles": (disc(0.0, 0.0),), "twist": (0.0, 0.0)},
        {"obstacles": (disc(0.25, 0.0),), "twist": (0.0, 0.0)},  # on ORCA's effective centre
        {"obstacles": (disc(0.3, 0.0, radius=0.0),)},
        {"walls": POINT},
        {"walls": POINT + np.array([0.25, 0.0])},
        {"walls": np.array([[[-1.0, 0.0], [1.0, 0.0]]])},
        {"lanes": INVERTED},  # nothing lies between them
    ],
    ids=str,
)
def test_a_degenerate_observation_is_decided_all_the_same(controller, alone, fields):
    decision = controller.decide(alone(**fields))
    assert np.isfinite([decision.v, decision.omega]).all()
    if decision.costs is not None:
        assert not np.isnan(decision.costs.total).any()
        assert np.isfinite(decision.costs.total).any()
        assert np.isfinite(decision.costs.cone).all()
