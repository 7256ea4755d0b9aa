"""One decision at full size: 400 candidates, 5 obstacles, 25 x 25 pairs each, degree 3; one desired set is topped up.

    pytest tests/benchmarks/test_decision.py --benchmark-enable --benchmark-only

prints times and the ratios between the ways to compute the matching cost. Without the option each runs once and only
their agreement is checked.
"""

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.messages import Observation, ObstacleSamples
from mjnav.rkhs.mmd import mmd_squared_gram

NUM_SAMPLES, NUM_OBSTACLES, DEGREE = 25, 5, 3
WHOLE, KERNEL, NUMPY, GRAM = "whole decision", "moment kernel", "NumPy moments", "Gram matrices (one pair, multiplied)"


@pytest.fixture(scope="module")
def observation():
    rng = np.random.default_rng(0)

    def disc(j):
        angle = 0.4 * (j - 2)
        place = (2.0 + 0.3 * j) * np.array([np.cos(angle), np.sin(angle)])
        position = place + 0.05 * (rng.gamma(2.0, size=(NUM_SAMPLES, 2)) - 2.0)
        velocity = -0.3 * place / np.hypot(*place) + 0.05 * rng.normal(size=(NUM_SAMPLES, 2))
        return ObstacleSamples(position, velocity, 0.3)

    return Observation(
        robot_pose=np.column_stack([0.03 * rng.normal(size=(NUM_SAMPLES, 2)), 0.03 * rng.normal(size=NUM_SAMPLES)]),
        control_noise=np.array([0.05, 0.08]) * rng.normal(size=(NUM_SAMPLES, 2)),
        twist=np.array([0.6, 0.0]),
        obstacles=tuple(disc(j) for j in range(NUM_OBSTACLES)),
        goal=np.array([8.0, 0.0]),
    )


@pytest.fixture(scope="module")
def controller(limits):
    return make_controller("rkhs", limits, 0.1, degree=DEGREE)


@pytest.fixture(scope="module")
def problem(controller, observation):
    return controller.problem(observation)


@pytest.fixture(scope="module")
def medians(request):
    """Median times [s] by name; the ratios are printed when all benchmarks have run."""
    times: dict[str, float] = {}
    yield times
    if KERNEL in times:
        capture = request.config.pluginmanager.get_plugin("capturemanager")
        with capture.global_and_fixture_disabled():
            print()
            for name, time in times.items():
                print(f"{name:40s} {1e3 * time:10.3f} ms {time / times[KERNEL]:10.1f} x the kernel")


def timed(benchmark, medians, name, function, *, times=1):
    function()  # compiled, caches warm
    value = benchmark(function)
    if benchmark.stats is not None:
        medians[name] = times * benchmark.stats.stats.median
    return value


def numpy_moments(problem):
    """Moments 1 ... DEGREE of all samples of all candidates, (K, J, DEGREE): plain array code, all pairs at once."""
    o, p, c = problem.observation, problem.parameters, problem.candidates
    heading = o.robot_pose[:, 2] + (c.omega[:, None] + o.control_noise[:, 1]) * p.preview
    speed = c.v[:, None] + o.control_noise[:, 0]
    velocity = np.stack([speed * np.cos(heading), speed * np.sin(heading)], axis=-1)  # (K, N, 2)
    out = np.empty((len(c.v), NUM_OBSTACLES, DEGREE))
    for j, disc in enumerate(o.obstacles):
        r = o.robot_pose[:, None, :2] - disc.position  # (N, M, 2)
        q = velocity[:, :, None, :] - disc.velocity  # (K, N, M, 2)
        t = np.clip(-(r * q).sum(-1) / (q * q).sum(-1), 0.0, p.horizon)
        closest = r + t[..., None] * q
        radius = problem.limits.radius + disc.radius + p.safety_margin
        f = np.maximum(1.0 - (closest * closest).sum(-1) / radius**2, -p.clip).reshape(len(c.v), -1)
        power = f
        for degree in range(DEGREE):
            out[:, j, degree] = power.mean(axis=1)
            power = power * f
    return out


def kernel_moments(problem):
    c = problem.candidates
    return problem.cone.moments(c.v, c.omega, DEGREE, np.zeros(NUM_OBSTACLES, bool))


def test_the_whole_decision_costs_all_candidates_and_obstacles(benchmark, medians, controller, observation):
    decision = timed(benchmark, medians, WHOLE, lambda: controller.decide(observation))
    assert decision.costs.cone.shape == (402, NUM_OBSTACLES)
    assert decision.costs.cone.any(axis=0).all()


def test_the_moment_kernel_covers_all_pairs(benchmark, medians, problem):
    moments = timed(benchmark, medians, KERNEL, lambda: kernel_moments(problem))
    assert moments.shape == (402, NUM_OBSTACLES, DEGREE)
    assert problem.cone.sizes.tolist() == [NUM_SAMPLES**2] * NUM_OBSTACLES


def test_moments_of_plain_arrays_are_those_of_the_kernel(benchmark, medians, problem):
    moments = timed(benchmark, medians, NUMPY, lambda: numpy_moments(problem))
    order = problem.cone.blocks.column
    assert kernel_moments(problem) == pytest.approx(moments[:, order], rel=1e-9, abs=1e-12)


def test_gram_matrices_give_the_decisions_costs(benchmark, medians, controller, problem):
    costs, c = controller.evaluate(problem), problem.candidates
    k, block = 123, 0
    column = problem.cone.blocks.column[block]
    nominal = problem.cone.samples(block, c.v[[problem.nominal]], c.omega[[problem.nominal]])[:, 0]
    desired = nominal[nominal <= 0.0]
    assert len(desired) >= controller.parameters.desired_min
    samples = problem.cone.samples(block, c.v[[k]], c.omega[[k]])[:, 0]
    times = len(c.v) * NUM_OBSTACLES
    value = timed(benchmark, medians, GRAM, lambda: mmd_squared_gram(samples, desired, degree=DEGREE), times=times)
    size = np.abs(samples).max() ** (2 * DEGREE) + 1.0
    assert value == pytest.approx(costs.cone[k, column], rel=1e-6, abs=1e-9 * size)
