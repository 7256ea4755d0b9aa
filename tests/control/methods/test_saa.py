from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mjnav.control import make_controller
from mjnav.control.kernels.cone_kernel import Samples
from mjnav.control.methods.saa import colliding_share

SMALL = {"num_v": 6, "num_omega": 7}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 9}


@pytest.mark.parametrize("options", [{}, {"form": "line"}, {"form": "ray", "normalise": False}])
@pytest.mark.parametrize("seed", range(6))
def test_the_risk_is_the_share_of_colliding_samples(observe, limits, constraint_samples, seed, options):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    controller = make_controller("saa", limits, 0.1, **SMALL, **options)
    costs = controller.decide(o).costs
    columns, lanes = constraint_samples(controller.problem(o))
    for j in range(len(o.obstacles) + len(o.walls)):
        shares = [sum(f > 0.0 for f in row) / len(row) for row in columns[j]] if j in columns else np.zeros(44)
        assert costs.cone[:, j].tolist() == list(shares)
    for side in (0, 1):
        assert costs.lane[:, side].tolist() == [sum(d > 0.0 for d in row) / len(row) for row in lanes[side]]


@given(st.integers(1, 30), st.integers(0, 100))
def test_a_share_of_exactly_one_less_eta_is_allowed(limits, num, percent):
    controller = make_controller("saa", limits, 0.1, eta=percent / 100)
    for count in range(num + 1):
        samples = np.where(np.arange(num) < count, 1.0, -1.0)[:, None]
        allowed = colliding_share(Samples.of(samples))[0] <= controller.bound
        assert allowed == (Fraction(count, num) <= 1 - Fraction(percent, 100))
