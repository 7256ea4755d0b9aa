"""`kld` against its risk written down a second time, and what must be true of it whatever the numbers."""

from math import exp, log, sqrt

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.control.kernels.mixture import NUM_CELLS

SMALL = {"num_v": 3, "num_omega": 4}
CROWDED = {"spread": 0.2, "near": 0.05, "far": 2.5, "num_samples": 7, "num_walls": 1}


def fit(samples, p):
    """[(weight, mean, variance)] by EM."""
    x = np.array(samples)
    spread, n = x.std(), p.num_components
    offsets = [2.0 * c / (n - 1) - 1.0 for c in range(n)] if n > 1 else [0.0]
    floor = p.std_floor**2
    mixture = [(1.0 / n, x.mean() + o * spread, max((spread / n) ** 2, floor)) for o in offsets]
    for _ in range(p.num_iterations):
        likelihood = np.array([w / sqrt(v) * np.exp(-((x - m) ** 2) / (2.0 * v)) for w, m, v in mixture])
        shares = likelihood / likelihood.sum(axis=0)
        mixture = []
        for r in shares:
            mean = (r * x).sum() / r.sum()
            mixture.append((r.mean(), mean, max((r * (x - mean) ** 2).sum() / r.sum(), floor)))
    return mixture


def gaussian_kl(a, b):
    return 0.5 * (log(b[2] / a[2]) + (a[2] + (a[1] - b[1]) ** 2) / b[2] - 1.0)


def mixture_kl(f, g):
    """Hershey & Olsen's variational approximation, equation by equation."""

    def log_sum(a, h):
        terms = [log(b[0]) - gaussian_kl(a, b) for b in h]
        return max(terms) + log(sum(exp(t - max(terms)) for t in terms))

    return max(0.0, sum(a[0] * (log_sum(a, f) - log_sum(a, g)) for a in f))


def literal(samples, desired, p):
    """The risk of one constraint at one candidate."""
    if not len(desired):
        samples, desired = [max(0.0, f) for f in samples], [0.0]
    return mixture_kl(fit(samples, p), fit(desired, p))


@pytest.fixture
def assert_as_written_down(limits, constraint_samples):
    """assert_as_written_down(observation, **parameters) -> the sizes of the desired sets."""
    return lambda observation, **parameters: compare(observation, limits, constraint_samples, **parameters)


def compare(observation, limits, constraint_samples, **parameters):
    # A floor so low that the components' own widths count.
    controller = make_controller("kld", limits, 0.1, **SMALL, **{"std_floor": 0.1, **parameters})
    problem, p = controller.problem(observation), controller.parameters
    cone, lane = controller.risk(problem)
    columns, lanes = constraint_samples(problem)
    wanted, sizes = controller.desired(problem), []
    terms = [
        (cone[:, block], columns[column], wanted.samples(block))
        for block, column in enumerate(problem.cone.blocks.column)
    ]
    terms += [(lane[:, side], samples, wanted.lane(side)) for side, samples in enumerate(lanes)]
    for risk, samples, desired in terms:
        assert samples.shape[1] <= NUM_CELLS
        exact = len(desired) <= NUM_CELLS  # more, and they are gathered in cells
        expected = [literal(row, desired, p) for row in samples]
        assert risk == pytest.approx(expected, rel=1e-6 if exact else 1e-3, abs=1e-9)
        sizes.append(len(desired))
    costs = controller.decide(observation).costs
    weighted = p.weight * cone.sum(axis=1) + p.lane_weights[0] * lane[:, 0] + p.lane_weights[1] * lane[:, 1]
    assert costs.total == pytest.approx(costs.goal + weighted)
    return sizes


@pytest.mark.parametrize("num_components", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_the_risk_is_as_written_down(assert_as_written_down, observe, seed, num_components):
    assert_as_written_down(observe(seed, spread=0.2), num_components=num_components, std_floor=0.3)


@pytest.mark.parametrize("seed", range(6))
def test_in_a_crowd_the_risk_is_as_written_down_with_empty_desired_sets_too(assert_as_written_down, observe, seed):
    one = {"num_samples": 1, "most": 1} if seed % 2 else {}
    options = {"desired_min": 0} if seed % 2 else {}
    sizes = assert_as_written_down(observe(seed, **{**CROWDED, **one}), window="bounds", **options)
    assert 0 in sizes or seed not in (1, 3, 5)
