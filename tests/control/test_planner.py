"""What is true of every plan: it ends at rest, is feasible where one is, and leaves the most time where none is."""

from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjnav.control import Status, make_controller
from mjnav.control.planner import effort
from mjnav.control.rollouts import Rollouts
from mjnav.messages import KnownMap, ObstacleSamples, RobotLimits
from mjnav.metrics.effort import control_cost

FEW = {"rollouts": 20}
SLOW = RobotLimits(max_acceleration=0.3, max_turn_rate=1.5, max_turn_acceleration=0.5)
BACK = RobotLimits(min_speed=-0.6, max_acceleration=0.9)


def watch(controller):
    """The list of all rollouts that it weighs with their risks: those of the fan first, then their mean."""
    risks_of, weighed = controller.risks_of, []

    def watched_risks_of(*problem):
        risks = risks_of(*problem)

        def watched(rollouts):
            found = risks(rollouts)
            weighed.append((rollouts, found))
            return found

        return watched

    controller.risks_of = watched_risks_of
    return weighed


def paths_of(observation, rollouts):
    """(K, T, 2) in the world."""
    return observation.robot_pose[:, :2].mean(axis=0) + np.stack([rollouts.x.T, rollouts.y.T], axis=-1)


@settings(max_examples=6)
@given(st.integers(0, 10_000), st.sampled_from([RobotLimits(), SLOW, BACK]), st.booleans())
def test_every_plan_ends_at_rest(observe, seed, limits, crowded):
    controller = make_controller("rkhs-plan", limits, 0.1, **FEW)
    weighed = watch(controller)
    decision = controller.decide(observe(seed, **({"near": 0.05, "far": 2.5} if crowded else {})))
    for rollouts, _ in weighed:
        assert np.abs(rollouts.controls[:, -1]).max() < 1e-12
    assert decision.plan.path[-1] == pytest.approx(decision.plan.path[-2], abs=1e-12)


def test_a_mean_that_is_not_feasible_is_never_followed(observe, limits):
    met = set()
    for seed in range(30):
        # A mean of all goes where none of them goes.
        controller = make_controller("rkhs-plan", limits, 0.1, **FEW, temperature=50.0)
        weighed = watch(controller)
        o = observe(seed, near=0.6, far=2.0)
        decision = controller.decide(o)
        (fan, risks), *rest = weighed
        if not decision.plan.feasible:
            assert (risks.contact > 0.5).all()
            continue
        mean, mean_risks = rest[0]
        follows_mean = (decision.plan.path == paths_of(o, mean)[0]).all()
        met.add(bool(mean_risks.contact[0] > 0.5))
        if mean_risks.contact[0] > 0.5:
            assert not follows_mean
            best = [k for k in range(len(risks.contact)) if (decision.plan.path == paths_of(o, fan)[k]).all()]
            assert risks.contact[best].max() <= 0.5
    assert met == {False, True}


def time_to_contact(path, observation, radius, step):
    """[s] until the first contact on a path (T, 2), on average over samples, one step after its end without any."""
    total, num = 0.0, len(observation.robot_pose)
    for s in range(num):
        first = (len(path) + 1) * step
        for t in reversed(range(len(path))):
            robot = path[t] - observation.robot_pose[:, :2].mean(axis=0) + observation.robot_pose[s, :2]
            for disc in observation.obstacles:
                at = disc.position[s] + (t + 1) * step * disc.velocity[s]
                if hypot(*(robot - at)) < radius + disc.radius:
                    first = (t + 1) * step
        total += first
    return total / num


@pytest.mark.parametrize(("method", "far_sighted"), [("mppi-plus", {}), ("rkhs-plan", {"fading": 5.0, "margin": 0.4})])
def test_where_nothing_is_feasible_the_plan_leaves_the_most_time(alone, limits, method, far_sighted):
    rng, people = np.random.default_rng(0), []
    for j in range(9):
        angle, distance = 2.0 * pi * j / 9, 1.0 + 0.05 * j  # a gap closes last at one side
        towards = np.array([cos(angle), sin(angle)])
        position = distance * towards + 0.02 * rng.normal(size=(4, 2))
        people.append(ObstacleSamples(position, np.tile(-0.5 * towards, (4, 1)), 0.3))
    o = alone(num_samples=4, twist=(0.0, 0.0), obstacles=people)
    controller = make_controller(method, limits, 0.1, **FEW, **far_sighted, safety_margin=0.0)
    weighed = watch(controller)
    decision = controller.decide(o)
    assert decision.status == Status.INFEASIBLE
    assert not decision.plan.feasible
    step = decision.plan.step
    times = [time_to_contact(path, o, limits.radius, step) for path in paths_of(o, weighed[0][0])]
    followed = time_to_contact(decision.plan.path, o, limits.radius, step)
    assert followed >= max(times) - 1e-9
    assert max(times) - min(times) > 0.1


def test_effort_is_the_control_cost_of_the_metrics(limits):
    commands = np.random.default_rng(0).normal(size=(2, 5, 3))
    nowhere = np.zeros((5, 3))
    rollouts = Rollouts(commands, nowhere, nowhere, nowhere, 0.2)
    found = effort(rollouts, np.zeros(2), 0.17)
    assert found == pytest.approx([control_cost(commands[:, :, k].T, 0.2) for k in range(3)])
    turned = effort(rollouts, commands[:, 0, 0], 0.17)  # of a robot that has the first command already
    assert turned[0] == pytest.approx(found[0] - control_cost(commands[:, :1, 0].T, 0.2))


def test_a_planner_with_a_map_goes_round_a_wall_before_which_it_stands_without(drive, limits):
    walls = np.array([[[1.5, -3.0], [1.5, 3.0]]])
    known = KnownMap(walls, np.array([0.0]), np.zeros((0, 3)))
    way = {"goal": (3.0, 0.0), "walls": walls, "seconds": 20.0}
    reached, clearance = drive(make_controller("rkhs-plan", limits, 0.1, **FEW), known=known, **way)
    assert reached
    assert clearance > 0.0
    assert not drive(make_controller("rkhs-plan", limits, 0.1, **FEW), **way)[0]
