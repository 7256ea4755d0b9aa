"""The moment kernel beside what the machine's arithmetic allows.

    pytest benchmarks/test_kernel_bound.py -n 0 --benchmark-enable --benchmark-only

prints nanoseconds per sample evaluation. Counted in the innermost loop for one sample of the segment form:

    x'_i - o'_m                                    2 additions
    |q|^2, r.q                                     4 multiply-adds (a multiplication counts as one)
    clip(-r.q, 0, |q|^2)                           1 minimum, 1 maximum
    w (-2 r.q - w)                                 1 multiply-add, 1 multiplication
    / |q|^2                                        1 division
    + R^2 - |r|^2, clip, sum of f                  1 addition, 1 maximum, 1 addition
    degree 3: f^2, its sum, that of f^3            1 multiplication, 1 addition, 1 multiply-add

Multiply-adds, minima and maxima share the same units on the machines at hand; additions and the division may run beside
them. So a sample takes at least as long as the slower of (multiply-adds + minima + maxima) at the rate of a loop of
multiply-adds, and one division at the rate of a loop of divisions, both measured here on arrays in the first cache and
compiled like the kernel.
"""

from math import inf
from typing import Any

import numpy as np
import pytest

from mjnav.compile.compiled import kernel
from mjnav.control import make_controller
from mjnav.control.methods.rkhs import Rkhs

SIZE, REPEATS = 512, 200  # float64: an array fills an eighth of the first cache
MULTIPLY_ADDS = 16
OPERATIONS = {1: 9, 3: 11}  # multiply-adds, minima and maxima of a sample, by degree
SECONDS = 3.0


@kernel
def multiply_adds(out, x, constants):
    """A polynomial of degree MULTIPLY_ADDS of every element, again and again."""
    a, b, c, d = constants[0], constants[1], constants[2], constants[3]
    for repeat in range(REPEATS):
        for i in range(x.size):
            z = x[i]
            y = z + repeat
            y = (((y * z + a) * z + b) * z + c) * z + d
            y = (((y * z + a) * z + b) * z + c) * z + d
            y = (((y * z + a) * z + b) * z + c) * z + d
            y = (((y * z + a) * z + b) * z + c) * z + d
            out[i] = y


@kernel
def divisions(out, x, constants):
    """A quotient of every element, again and again."""
    for repeat in range(REPEATS):
        for i in range(x.size):
            out[i] = constants[0] / (x[i] + repeat)


@pytest.mark.parametrize("degree", [1, 3])
def test_the_kernel_runs_near_the_machines_arithmetic(
    benchmark, lines, measuring, least_times, approaching, limits, degree
):
    observation = approaching()
    # Without the clip no pair is out of reach: every sample is evaluated.
    controller: Any = make_controller(Rkhs, limits, 0.1, degree=degree, clip=inf)
    problem = controller.problem(observation)
    c, cone = problem.candidates, problem.cone
    no_hinge = np.zeros(len(cone.sizes), bool)

    def evaluate():
        return cone.raw_moments(c.v, c.omega, degree, no_hinge)

    rng = np.random.default_rng(0)
    x, out, constants = rng.uniform(0.5, 0.9, SIZE), np.empty(SIZE), rng.uniform(0.5, 1.0, 4)
    benchmark.pedantic(evaluate, rounds=10, warmup_rounds=1)
    functions = {
        "kernel": evaluate,
        "multiply-add": lambda: multiply_adds(out, x, constants),
        "division": lambda: divisions(out, x, constants),
    }
    least = least_times(functions, SECONDS)
    if measuring:
        sample = 1e9 * least["kernel"] / (len(c.v) * cone.sizes.sum())
        multiply_add = 1e9 * least["multiply-add"] / (SIZE * REPEATS * MULTIPLY_ADDS)
        division = 1e9 * least["division"] / (SIZE * REPEATS)
        bound = max(OPERATIONS[degree] * multiply_add, division)
        lines.append(
            f"degree {degree}: {sample:.3f} ns per sample; {OPERATIONS[degree]} multiply-adds, minima and maxima of "
            f"{multiply_add:.4f} ns and one division of {division:.3f} ns allow {bound:.3f} ns: {bound / sample:.0%}"
        )
    moments, samples = evaluate(), cone.samples(0, c.v, c.omega)
    assert moments[:, 0, 0] == pytest.approx(samples.mean(axis=0), rel=1e-12, abs=1e-12)
    assert moments[:, 0, -1] == pytest.approx((samples**degree).mean(axis=0), rel=1e-12, abs=1e-12)
