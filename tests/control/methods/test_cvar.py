import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mjnav.control import make_controller
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.methods.cvar import conditional_value_at_risk

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


def value(samples, eta):
    return conditional_value_at_risk(Samples.of(samples), eta)


@pytest.mark.parametrize("options", [{}, {"form": "line", "clip": np.inf}, {"form": "ray", "normalise": False}])
@pytest.mark.parametrize("eta", [0.3, 0.9])
@pytest.mark.parametrize("seed", range(6))
def test_the_risk_is_the_mean_of_the_worst_samples(observe, limits, constraint_samples, seed, eta, options):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    controller = make_controller("cvar", limits, 0.1, **SMALL, **options, eta=eta)
    costs = controller.decide(o).costs
    columns, lanes = constraint_samples(controller.problem(o))
    for j in range(len(o.obstacles) + len(o.walls)):
        expected = [worst_mean(row, eta) for row in columns[j]] if j in columns else 0.0
        assert costs.cone[:, j] == pytest.approx(np.array(expected), rel=1e-9, abs=1e-9)
    for side in (0, 1):
        assert costs.lane[:, side] == pytest.approx(np.array([worst_mean(d, eta) for d in lanes[side]]), abs=1e-9)


@given(SAMPLES, LEVELS)
def test_it_is_the_mean_of_the_worst_share(samples, eta):
    expected = np.array([worst_mean(column, eta) for column in samples.T])
    assert value(samples, eta) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@given(SAMPLES)
def test_at_level_zero_it_is_the_mean_and_towards_one_the_largest(samples):
    assert value(samples, 0.0) == pytest.approx(samples.mean(axis=0), rel=1e-12, abs=1e-12)
    assert value(samples, 1e-9) == pytest.approx(samples.mean(axis=0), abs=1e-7)
    for eta in (1.0, 1.0 - 1.0 / len(samples)):
        assert value(samples, eta) == pytest.approx(samples.max(axis=0), rel=1e-12, abs=1e-12)
