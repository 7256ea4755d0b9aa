"""How the time of one decision grows with samples, obstacles and candidates, for each method.

    pytest tests/benchmarks/test_decision_scaling.py --benchmark-enable --benchmark-only

takes two to three minutes and prints least times [ms] and, fitted to them, the exponents of growth: log time = exponent
log size + constant, one size at a time, the others at N = M = 25 samples, J = 5 obstacles, K = 400 candidates. Beside
the methods stand the same moments by plain arrays, and by Gram matrices, of which one candidate and one obstacle are
timed and multiplied. A method that does not choose from the grid does not grow with K. Without the option each method
decides a few small cases once.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mjnav.control import make_controller, names
from mjnav.control.problem.problem import Problem
from mjnav.rkhs.mmd import mmd_squared, mmd_squared_gram

SIZES = {"N": (25, 50, 100), "J": (1, 5, 20, 100), "K": (100, 400, 1600)}
SMALL = {"N": (3, 4), "J": (1, 3), "K": (4, 9)}
CANDIDATES = {"mppi": ("rollouts",), "orca": ()}  # what gives their number, where it is not the grid
SECONDS = 5.0  # a row of the table
DEGREE = 3
NUMPY, GRAM = "NumPy moments, degree 3", "Gram matrices, degree 3"


@dataclass(frozen=True)
class Case:
    """One size of problem."""

    N: int = 25
    J: int = 5
    K: int = 400

    def controller(self, name, limits, **parameters):
        grid = dict.fromkeys(("num_v", "num_omega"), round(self.K**0.5))
        number = dict.fromkeys(CANDIDATES[name], self.K) if name in CANDIDATES else grid
        sight = {"samples": self.N, "max_obstacles": self.J, "sensing_range": 30.0}
        return make_controller(name, limits, 0.1, **number, **sight, **parameters)


@pytest.fixture(scope="module")
def cases(measuring):
    """Every case, each size varied by itself."""
    sizes = SIZES if measuring else SMALL
    base = Case() if measuring else Case(N=3, J=3, K=9)
    return list(dict.fromkeys(replace(base, **{key: n}) for key in sizes for n in sizes[key]))


@pytest.fixture(scope="module")
def table(lines):
    """Times [s] by row and case."""
    rows: dict[str, dict[Case, float]] = {}
    yield rows
    columns = [(key, n) for key in SIZES for n in SIZES[key]]
    lines.append(f"{'ms':24s}" + "".join(f"{f'{k} = {n}':>10s}" for k, n in columns) + "   exponents of N, J, K")
    for name, times in rows.items():
        cells = [times.get(replace(Case(), **{key: n}), np.nan) for key, n in columns]
        text = "".join(f"{1e3 * t:10.2f}" if np.isfinite(t) else f"{'-':>10s}" for t in cells)
        fits = [exponent(times, key) for key in SIZES]
        lines.append(f"{name:24s}{text}   " + " ".join("    -" if np.isnan(e) else f"{e:5.2f}" for e in fits))


def exponent(times, key):
    """Slope of log time over log size, by least squares."""
    points = [(n, times[case]) for n in SIZES[key] if (case := replace(Case(), **{key: n})) in times]
    if len(points) < 2:
        return np.nan
    size, time = np.log(points).T
    return np.polyfit(size, time, 1)[0]


@pytest.mark.parametrize("name", names())
def test_every_method_decides_every_size(benchmark, table, least_times, cases, approaching, limits, name):
    decide, decisions = {}, {}
    for case in cases:
        observation, controller = approaching(case.N, case.J), case.controller(name, limits)

        def run(case=case, observation=observation, controller=controller):
            decisions[case] = controller.decide(replace(observation))

        decide[case] = run
    benchmark.pedantic(decide[cases[0]], rounds=3)
    table[name] = least_times(decide, SECONDS)
    for case, decision in decisions.items():
        # At least as many as the grid has: its own and keep and brake, or what takes their place.
        assert decision.costs is None or len(decision.costs.v) >= case.K
        assert decision.costs is None or decision.costs.cone.shape[1] == case.J


def test_plain_arrays_do_the_same_for_every_size(
    benchmark, table, least_times, cases, approaching, numpy_moments, limits
):
    problems = {}
    for case in cases:
        controller = case.controller("rkhs", limits, degree=DEGREE)
        problems[case] = Problem(approaching(case.N, case.J), limits, 0.1, controller.parameters)
    benchmark.pedantic(lambda: numpy_moments(problems[cases[0]], DEGREE), rounds=1)
    table[NUMPY] = least_times({c: lambda p=p: numpy_moments(p, DEGREE) for c, p in problems.items()}, 0.0)
    for problem in problems.values():
        c, num_blocks = problem.candidates, len(problem.cone.blocks.column)
        moments = problem.cone.raw_moments(c.v, c.omega, DEGREE, np.zeros(num_blocks, bool))
        expected = numpy_moments(problem, DEGREE)[:, problem.cone.blocks.column]
        assert moments == pytest.approx(expected, rel=1e-9, abs=1e-12)


def test_gram_matrices_take_one_candidate_and_obstacle_a_time(benchmark, table, least_times, measuring, cases):
    rng = np.random.default_rng(0)
    functions, expected = {}, {}
    for case in dict.fromkeys(replace(cases[0], N=n) for n in ((25, 50) if measuring else (3,))):
        x, y = rng.uniform(-2.0, 0.0, (2, case.N**2))  # as safe as f usually is
        functions[case] = lambda x=x, y=y: mmd_squared_gram(x, y, degree=DEGREE)
        expected[case] = mmd_squared(x, y, degree=DEGREE)
    benchmark.pedantic(functions[cases[0]], rounds=1)
    times = least_times(functions, SECONDS)
    table[GRAM] = {case: time * case.J * (case.K + 2) for case, time in times.items()}
    for case, function in functions.items():
        assert function() == pytest.approx(expected[case], rel=1e-9, abs=1e-9)
