from dataclasses import replace
from math import exp, log, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.control import Status, make_controller
from mjnav.control.methods.mppi import Plan, perturbations, softmin
from mjnav.geometry.angles import circular_mean
from mjnav.messages import RobotLimits
from mjnav.motion.unicycle import integrate, reachable

LIMITS = RobotLimits(max_speed=1.1, min_speed=-0.2, max_turn_rate=1.4, max_acceleration=1.5, max_turn_acceleration=4.0)
SMALL = {"rollouts": 12, "steps": 6, "step": 0.3, "knots": 3}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 7}
# -------------------------------------------------------------------------------------------- the update


def test_the_weights_have_exact_small_answers():
    assert softmin(np.array([5.0, 5.0]), 0.1).tolist() == [0.5, 0.5]
    assert softmin(np.array([1.0, 1.0 + 0.2 * log(3.0)]), 0.2) == pytest.approx([0.75, 0.25])
    assert softmin(np.array([0.0, 1e9, 2e9]), 1e-3).tolist() == [1.0, 0.0, 0.0]
    assert softmin(np.array([-3.0]), 1e-9).tolist() == [1.0]


def test_the_plan_is_the_weighted_mean_of_the_rollouts(observe, limits):
    controller = make_controller("mppi", limits, 0.1, rollouts=50, risk_bound=1.0)
    checked = 0
    for seed in range(10):
        decision = controller.decide(observe(seed, far=8.0, near=3.0))
        costs = decision.costs
        weights = [exp((min(costs.total[:-1]) - s) / controller.parameters.temperature) for s in costs.total[:-1]]
        if np.argmin(costs.total[:-1]) == 0:
            assert (decision.v, decision.omega) == (costs.v[0], costs.omega[0])
            continue
        for decided, controls in ((decision.v, costs.v), (decision.omega, costs.omega)):
            assert decided == pytest.approx(sum(w * u for w, u in zip(weights, controls, strict=False)) / sum(weights))
        checked += 1
    assert checked >= 7


def test_perturbations_come_in_opposite_pairs_and_are_linear_between_knots():
    noise = perturbations(4001, 9, 3, (0.3, 0.7))
    assert noise.shape == (2, 9, 4001)
    assert (noise[:, :, 0:4000:2] == -noise[:, :, 1:4000:2]).all()
    for t in (1, 2, 3):
        assert noise[:, t] == pytest.approx((noise[:, 0] * (4 - t) + noise[:, 4] * t) / 4)
    for t in (0, 4, 8):
        assert noise[:, t].std(axis=1) == pytest.approx([0.3, 0.7], rel=0.05)
    assert abs(np.corrcoef(noise[0, 0, ::2], noise[0, 4, ::2])[0, 1]) < 4.0 / sqrt(2000)
    assert (perturbations(4001, 9, 3, (0.3, 0.7)) == noise).all()


# ---------------------------------------------------------------------------------------------- the plan


def test_a_plan_moved_on_is_read_between_its_steps_and_its_end_is_held():
    plan = Plan(0.0, np.array([[0.0, 1.0, 3.0], [0.0, -1.0, 0.0]]))
    assert plan.after(0.2, 0.2).tolist() == [[1.0, 3.0, 3.0], [-1.0, 0.0, 0.0]]
    assert plan.after(0.1, 0.2) == pytest.approx(np.array([[0.5, 2.0, 3.0], [-0.5, -0.5, 0.0]]))
    assert plan.after(9.0, 0.2).tolist() == [[3.0, 3.0, 3.0], [0.0, 0.0, 0.0]]


def at(observation, time):
    return replace(observation, time=time)


@pytest.mark.parametrize(("time", "kept"), [(5.1, True), (7.0, True), (7.1, False), (5.0, False), (4.9, False)])
def test_a_plan_is_dropped_where_time_does_not_advance_or_leaps(observe, limits, time, kept):
    o = observe(2)
    fresh = make_controller("mppi", limits, 0.1, step=0.205).decide(at(o, time))
    planned = make_controller("mppi", limits, 0.1, step=0.205)
    planned.decide(at(observe(4), 5.0))
    after = planned.decide(at(o, time))
    assert ((after.v, after.omega) != (fresh.v, fresh.omega)) == kept
    assert (after.costs.total.tobytes() != fresh.costs.total.tobytes()) == kept


def test_the_shown_plan_is_where_its_controls_lead_and_the_fan_is_spread_over_the_order_of_cost(observe, limits):
    controller = make_controller("mppi", limits, 0.1)
    o = observe(3, near=2.0, far=6.0)
    decision = controller.decide(o)
    shown, total = decision.plan, decision.costs.total[:-1]
    pose = np.array([*o.robot_pose[:, :2].mean(axis=0), circular_mean(o.robot_pose[:, 2])])
    for point, v, omega in zip(shown.path, *controller._plan.controls, strict=True):
        pose = integrate(pose, v, omega, shown.step)
        assert point == pytest.approx(pose[:2], abs=1e-9)
    assert shown.fan.shape == (32, *shown.path.shape)
    assert shown.fan_cost.tolist() == np.sort(total)[np.linspace(0, len(total) - 1, 32).astype(int)].tolist()
    k = int(np.argmin(total))  # each path is its own rollout's: the first step of the cheapest
    first = integrate(np.array([*o.robot_pose[:, :2].mean(axis=0), circular_mean(o.robot_pose[:, 2])]),
                      decision.costs.v[k], decision.costs.omega[k], shown.step)  # fmt: skip
    assert shown.fan[0, 0] == pytest.approx(first[:2], abs=1e-9)
    assert shown.feasible == (decision.status != Status.INFEASIBLE)


# ------------------------------------------------------------------------------------------------ limits

twists = st.tuples(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))


@given(twists, twists, st.integers(0, 20), st.sampled_from([0.02, 0.1, 0.5]), st.booleans())
def test_a_decided_control_is_within_reach_and_so_is_the_whole_plan(observe, first, second, seed, period, crowded):
    controller = make_controller("mppi", LIMITS, period, **SMALL)
    for time, twist in enumerate((first, second)):
        o = replace(observe(seed + time, **(CROWDED if crowded else {})), twist=np.array(twist), time=0.3 * time)
        decision = controller.decide(o)
        low, high = reachable(twist, LIMITS, period)
        assert (low <= (decision.v, decision.omega)).all()
        assert (high >= (decision.v, decision.omega)).all()
        change = np.abs(np.diff(controller._plan.controls, axis=1)).max(axis=1)
        assert (change <= np.array([1.5, 4.0]) * SMALL["step"] + 1e-9).all()


# ---------------------------------------------------------------------------------------------- statuses


@pytest.mark.parametrize("seed", range(12))
def test_without_uncertainty_a_status_is_infeasible_where_no_rollout_is_free(observe, limits, seed):
    o = observe(seed, **{**CROWDED, "num_samples": 1, "most": 1, "num_walls": 1})
    decision = make_controller("mppi", limits, 0.1).decide(o)
    free = (decision.costs.cone.sum(axis=1) == 0.0) & (decision.costs.lane.sum(axis=1) == 0.0)
    assert free[-1] == free.any()
    assert (decision.status == Status.INFEASIBLE) == (not free.any())
    if not free.any():
        assert decision.costs.total[-1] == decision.costs.total[:-1].min()


# -------------------------------------------------------------------------------------------- degenerate
