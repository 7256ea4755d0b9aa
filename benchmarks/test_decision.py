"""One decision at full size: 400 candidates, 5 obstacles, 25 x 25 pairs each, degree 3; one desired set is topped up.

    pytest benchmarks/test_decision.py -n 0 --benchmark-enable --benchmark-only

prints least times and the ratios between the ways to compute the matching cost. Without the option each runs once and
only their agreement is checked.
"""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.control.methods.rkhs import Rkhs

NUM_SAMPLES, NUM_OBSTACLES, DEGREE = 25, 5, 3
WHOLE, KERNEL, NUMPY, GRAM = "whole decision", "moment kernel", "NumPy moments", "Gram matrices (one pair, multiplied)"


@pytest.fixture(scope="module")
def observation(approaching):
    return approaching(NUM_SAMPLES, NUM_OBSTACLES)


@pytest.fixture(scope="module")
def controller(limits):
    return make_controller(Rkhs, limits, 0.1, degree=DEGREE)


@pytest.fixture(scope="module")
def problem(controller, observation):
    return controller.problem(observation)


@pytest.fixture(scope="module")
def times(lines):
    """Least times [s] by name; the ratios are printed when all benchmarks have run."""
    least: dict[str, float] = {}
    yield least
    if {WHOLE, KERNEL} <= set(least):
        lines += [
            f"{name:40s} {1e3 * time:10.3f} ms {time / least[KERNEL]:9.1f} x the kernel {time / least[WHOLE]:9.1f} x "
            "the decision"
            for name, time in least.items()
        ]


def timed(benchmark, times, name, function, *, rounds, prepare=None, multiply=1):
    value = benchmark.pedantic(function, setup=prepare, rounds=rounds, warmup_rounds=1)
    if benchmark.stats is not None:
        times[name] = multiply * benchmark.stats.stats.min
    return value


def gram_mmd_squared(x, y):
    """MMD^2 by Gram matrices of the kernel (x y + 1)^d."""
    gram = [(np.multiply.outer(a, b) + 1.0) ** DEGREE for a, b in ((x, x), (x, y), (y, y))]
    return gram[0].mean() - 2.0 * gram[1].mean() + gram[2].mean()


def kernel_moments(problem):
    c = problem.candidates
    return problem.cone.raw_moments(c.v, c.omega, DEGREE, np.zeros(NUM_OBSTACLES, bool))


def test_the_whole_decision_costs_all_candidates_and_obstacles(benchmark, times, controller, observation):
    def prepare():
        return (replace(observation),), {}  # a new one: of the same observation the controller knows the problem

    decision = timed(benchmark, times, WHOLE, controller.decide, rounds=500, prepare=prepare)
    assert decision.costs.cone.shape == (402, NUM_OBSTACLES)
    assert decision.costs.cone.any(axis=0).all()


def test_the_moment_kernel_covers_all_pairs(benchmark, times, problem):
    moments = timed(benchmark, times, KERNEL, lambda: kernel_moments(problem), rounds=500)
    assert moments.shape == (402, NUM_OBSTACLES, DEGREE)
    assert problem.cone.sizes.tolist() == [NUM_SAMPLES**2] * NUM_OBSTACLES


def test_moments_of_plain_arrays_are_those_of_the_kernel(benchmark, times, problem, numpy_moments):
    moments = timed(benchmark, times, NUMPY, lambda: numpy_moments(problem, DEGREE), rounds=10)
    order = problem.cone.blocks.column
    assert kernel_moments(problem) == pytest.approx(moments[:, order], rel=1e-9, abs=1e-12)


def test_gram_matrices_give_the_decisions_costs(benchmark, times, controller, problem):
    costs, c = controller.evaluate(problem), problem.candidates
    k, block = 123, 0
    column = problem.cone.blocks.column[block]
    nominal = problem.cone.samples(block, c.v[[problem.nominal]], c.omega[[problem.nominal]])[:, 0]
    desired = nominal[nominal <= 0.0]
    assert len(desired) >= controller.parameters.desired_min
    samples = problem.cone.samples(block, c.v[[k]], c.omega[[k]])[:, 0]
    value = timed(
        benchmark, times, GRAM, lambda: gram_mmd_squared(samples, desired),
        rounds=200, multiply=len(c.v) * NUM_OBSTACLES,
    )  # fmt: skip
    size = np.abs(samples).max() ** (2 * DEGREE) + 1.0
    assert value == pytest.approx(costs.cone[k, column], rel=1e-6, abs=1e-9 * size)
