import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.rkhs.gaussian import FARTHEST

SMALL = {"num_v": 6, "num_omega": 7}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 9}


def gram_mmd(f, bandwidth):
    """MMD^2 of max(0, f) to a point mass at 0 by the definition's Gram matrices."""
    x, zero = np.maximum(np.asarray(f), 0.0), np.zeros(1)

    def k(a, b):
        return np.exp(-((a[:, None] - b[None, :]) ** 2) / (2.0 * bandwidth**2))

    alpha = np.full(len(x), 1.0 / len(x))
    return float(alpha @ k(x, x) @ alpha - 2.0 * alpha @ k(x, zero)[:, 0] + 1.0)


@pytest.mark.parametrize("options", [{}, {"form": "line"}, {"form": "ray", "normalise": False}])
@pytest.mark.parametrize("bandwidth", [0.3, 1.5])
@pytest.mark.parametrize("seed", range(6))
def test_the_risk_is_that_of_gram_matrices(observe, limits, constraint_samples, seed, bandwidth, options):
    o = observe(seed, **(CROWDED if seed % 2 else {}))
    controller = make_controller("mmd-dirac", limits, 0.1, **SMALL, **options, bandwidth=bandwidth)
    p, costs = controller.parameters, controller.decide(o).costs
    columns, lanes = constraint_samples(controller.problem(o))
    for j in range(len(o.obstacles) + len(o.walls)):
        expected = [gram_mmd(row, bandwidth) for row in columns[j]] if j in columns else 0.0
        assert costs.cone[:, j] == pytest.approx(np.array(expected), rel=0.0, abs=1e-9)
    for side in (0, 1):
        capped = np.minimum(lanes[side], FARTHEST * bandwidth)
        assert costs.lane[:, side] == pytest.approx(np.array([gram_mmd(d, bandwidth) for d in capped]), abs=1e-9)
    assert costs.total == pytest.approx(costs.goal + p.weight * costs.cone.sum(1) + costs.lane @ p.lane_weights)
