"""The cost surface: the method's own costs, with the decision's own nominal controls, at every node of a grid."""

from contextlib import suppress

import numpy as np
import pytest

from mjnav.control import make_controller, names
from mjnav.control.base import ConstrainedController, GridController, WeightedController
from mjnav.control.decision_surface import decision_surface, require_candidates
from mjnav.errors import InvalidValue
from mjnav.messages import RobotLimits
from mjnav.rkhs.mmd import mmd_squared

SMALL = {"num_v": 5, "num_omega": 5}
PERIOD = 0.2


def kinds(kind):
    """The methods with candidates that are of a kind."""
    found = []
    for name in names():
        controller = make_controller(name, RobotLimits(), PERIOD)
        with suppress(InvalidValue):
            require_candidates(controller, name)
            found += [name] if isinstance(controller, kind) else []
    return found


@pytest.fixture(params=kinds(GridController))
def controller(request, limits):
    return make_controller(request.param, limits, PERIOD, **SMALL)


def surface_of(controller, observation, **options):
    return decision_surface(controller, observation, controller.decide(observation), **options)


@pytest.mark.parametrize("seed", [1])
def test_on_the_decisions_own_candidates_the_surface_is_what_was_decided_on(controller, observe, seed):
    o = observe(seed)
    s, costs = surface_of(controller, o, window=controller.parameters.window, num=5), controller.decide(o).costs
    weight, lane_weights = controller.weights if isinstance(controller, WeightedController) else (1.0, np.ones(2))
    k = 0
    for i, v in enumerate(s.v):
        for j, omega in enumerate(s.omega):
            assert (v, omega) == (costs.v[k], costs.omega[k])
            assert s.goal[i, j] == costs.goal[k]
            size = 1.0 + np.abs(costs.cone).max()
            assert s.cone[i, j] == pytest.approx(weight * costs.cone[k], rel=1e-9, abs=1e-12 * weight * size)
            assert s.lane[i, j] == pytest.approx(lane_weights * costs.lane[k], rel=1e-9, abs=1e-12)
            assert s.total[i, j] == pytest.approx(costs.total[k], rel=1e-9, abs=1e-12 * weight * size)
            k += 1


@pytest.mark.parametrize("name", ["rkhs", "rkhs-paper"])
@pytest.mark.parametrize("seed", range(4))
def test_beyond_reach_every_control_is_matched_with_what_the_decision_desired(observe, limits, name, seed):
    o = observe(seed, num_walls=1)
    controller = make_controller(name, limits, PERIOD, **SMALL, window="reachable")
    p, problem = controller.parameters, controller.problem(o)
    s = surface_of(controller, o, window="bounds", num=3)
    columns = problem.cone.blocks.column.tolist()
    for i, v in enumerate(s.v):
        for j, omega in enumerate(s.omega):
            for block, column in enumerate(columns):
                samples = problem.cone.samples(block, np.array([v]), np.array([omega]))[:, 0]
                desired = controller.desired_cone(problem, block)
                if not len(desired):
                    samples, desired = np.maximum(samples, 0.0), np.zeros(1)
                kernel = {"degree": p.degree, "scale": p.scale, "offset": p.offset}
                size = 1.0 + np.abs(samples).max() ** (2 * p.degree)
                expected = mmd_squared(samples, desired, **kernel) ** (0.5 if p.root else 1.0)
                assert s.cone[i, j, column] == pytest.approx(p.weight * expected, rel=1e-6, abs=1e-9 * p.weight * size)
    rest = [j for j in range(s.cone.shape[2]) if j not in columns]
    assert not s.cone[:, :, rest].any()


@pytest.mark.parametrize("name", kinds(ConstrainedController))
def test_what_exceeds_the_bound_is_forbidden_and_the_rest_costs_its_way_to_the_goal(observe, limits, name):
    controller, checked = make_controller(name, limits, PERIOD, **SMALL, penalty=np.inf), 0
    for seed in range(8):
        s = surface_of(controller, observe(seed, far=8.0, lanes=False), num=9)
        assert not s.weighted
        assert (s.cone_term == s.cone[:, :, s.cone.any(axis=(0, 1))].max(axis=-1)).all()
        allowed = s.cone_term <= controller.bound
        if allowed.any():
            assert (np.isfinite(s.total) == allowed).all()
            assert (s.total[allowed] == s.goal[allowed]).all()
            checked += not allowed.all()
    assert checked >= 3


# ------------------------------------------------------------------------------------------- refusals


def test_a_method_without_candidates_is_refused_with_those_that_have_them():
    class Still:
        def decide(self, observation):
            raise NotImplementedError

    with pytest.raises(InvalidValue, match=r"control\.method: found 'still'; .*mean, .*rkhs, rkhs-paper") as refused:
        require_candidates(Still(), "still")
    listed = refused.value.allowed.rpartition(": ")[2].split(", ")
    assert listed == kinds(GridController)
