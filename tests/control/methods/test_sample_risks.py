"""`cvar`, `saa` and `mmd-dirac`: a risk of each constraint's samples alone, against the same one row at a time."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.control import make_controller
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.methods.cvar import conditional_value_at_risk
from mjnav.control.methods.saa import colliding_share
from mjnav.rkhs.gaussian import FARTHEST
from tests.rkhs.test_gaussian import gaussian, gram_mmd_squared

SMALL = {"num_v": 6, "num_omega": 7}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 9}
# Few values among them, so that samples are often equal.
VALUES = st.one_of(st.sampled_from([-2.0, 0.0, 0.5]), st.floats(-2.0, 1.0, width=32))
SAMPLES = arrays(float, st.tuples(st.integers(1, 60), st.just(3)), elements=VALUES)
LEVELS = st.one_of(st.sampled_from([0.0, 0.5, 0.9]), st.floats(0.0, 0.999))


def worst_mean(samples, eta):
    """The mean of the worst (1 - eta) n samples: one after another, the last by what is left of it."""
    left = tail = (1.0 - eta) * len(samples)
    total = 0.0
    for f in sorted(samples, reverse=True):
        part = min(1.0, left)
        total, left = total + part * f, left - part
    return total / tail


RISKS = {
    "cvar": lambda row, p: worst_mean(row, p.eta),
    "saa": lambda row, p: sum(f > 0.0 for f in row) / len(row),
    "mmd-dirac": lambda row, p: gram_mmd_squared(np.minimum(row, FARTHEST * p.bandwidth), gaussian(p.bandwidth)),
}


@pytest.mark.parametrize("options", [{}, {"form": "line"}, {"form": "ray", "normalise": False}])
@pytest.mark.parametrize(
    ("name", "level"),
    [("cvar", {"eta": 0.3}), ("cvar", {"eta": 0.9}), ("saa", {}), ("mmd-dirac", {"bandwidth": 0.3}), ("mmd-dirac", {})],
)
@pytest.mark.parametrize("seed", range(6))
def test_the_risk_is_that_of_each_row_of_samples(observe, limits, constraint_samples, seed, name, level, options):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    controller = make_controller(name, limits, 0.1, **SMALL, **options, **level)
    p, costs = controller.parameters, controller.decide(o).costs
    columns, lanes = constraint_samples(controller.problem(o))
    for j in range(len(o.obstacles) + len(o.walls)):
        expected = [RISKS[name](row, p) for row in columns[j]] if j in columns else 0.0
        assert costs.cone[:, j] == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9)
    for side in (0, 1):
        assert costs.lane[:, side] == pytest.approx(np.array([RISKS[name](d, p) for d in lanes[side]]), abs=1e-9)
    if name == "mmd-dirac":
        assert costs.total == pytest.approx(costs.goal + p.weight * costs.cone.sum(1) + costs.lane @ p.lane_weights)


@given(SAMPLES, LEVELS)
def test_the_value_at_risk_is_the_mean_of_the_worst_share_the_mean_at_0_and_the_largest_towards_1(samples, eta):
    kept = Samples.of(samples)
    expected = np.array([worst_mean(column, eta) for column in samples.T])
    assert conditional_value_at_risk(kept, eta) == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert conditional_value_at_risk(kept, 0.0) == pytest.approx(samples.mean(axis=0), rel=1e-12, abs=1e-12)
    for last in (1.0, 1.0 - 1.0 / len(samples)):
        assert conditional_value_at_risk(kept, last) == pytest.approx(samples.max(axis=0), rel=1e-12, abs=1e-12)


@given(st.integers(1, 30), st.integers(0, 100))
def test_a_share_of_exactly_one_less_eta_is_allowed(limits, num, percent):
    controller = make_controller("saa", limits, 0.1, eta=percent / 100)
    for count in range(num + 1):
        samples = np.where(np.arange(num) < count, 1.0, -1.0)[:, None]
        allowed = colliding_share(Samples.of(samples))[0] <= controller.bound
        assert allowed == (Fraction(count, num) <= 1 - Fraction(percent, 100))
