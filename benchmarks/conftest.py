"""What the benchmarks of one decision share: the observation, the plain-array way to its moments, timing, printing."""

import time
from collections.abc import Callable

import numpy as np
import pytest

from mjnav.messages import Array, Observation, ObstacleSamples, RobotLimits


@pytest.fixture(scope="session")
def measuring(request) -> bool:
    """Whether times are asked for; without, everything runs once and small."""
    return not request.config.getoption("benchmark_disable") or request.config.getoption("benchmark_enable")


@pytest.fixture(scope="session")
def approaching() -> Callable[..., Observation]:
    """approaching(num_samples, num_obstacles) -> discs ahead of the robot that come towards it.

    Discs 0 ... 4 stand on an arc, the next five behind them and so on. Of five discs, a tenth of all pairs stays so far
    apart that the clip takes it for all candidates.
    """

    def build(num_samples: int = 25, num_obstacles: int = 5) -> Observation:
        rng = np.random.default_rng(0)

        def disc(j: int) -> ObstacleSamples:
            angle = 0.4 * (j % 5 - 2)
            place = (2.0 + 0.3 * (j % 5) + 0.05 * (j // 5)) * np.array([np.cos(angle), np.sin(angle)])
            position = place + 0.05 * (rng.gamma(2.0, size=(num_samples, 2)) - 2.0)
            velocity = -0.3 * place / np.hypot(*place) + 0.05 * rng.normal(size=(num_samples, 2))
            return ObstacleSamples(position, velocity, 0.3)

        return Observation(
            robot_pose=0.03 * rng.normal(size=(num_samples, 3)),
            control_noise=np.array([0.05, 0.08]) * rng.normal(size=(num_samples, 2)),
            twist=np.array([0.6, 0.0]),
            obstacles=tuple(disc(j) for j in range(num_obstacles)),
            goal=np.array([8.0, 0.0]),
        )

    return build


@pytest.fixture(scope="session")
def numpy_moments() -> Callable[..., Array]:
    """numpy_moments(problem, degree) -> means of f^p, p = 1 ... degree, (K, J, degree): arrays, all pairs at once."""

    def moments(problem, degree: int) -> Array:
        o, p, c = problem.observation, problem.parameters, problem.candidates
        heading = o.robot_pose[:, 2] + (c.omega[:, None] + o.control_noise[:, 1]) * p.preview
        speed = c.v[:, None] + o.control_noise[:, 0]
        velocity = np.stack([speed * np.cos(heading), speed * np.sin(heading)], axis=-1)  # (K, N, 2)
        out = np.empty((len(c.v), len(o.obstacles), degree))
        for j, disc in enumerate(o.obstacles):
            r = o.robot_pose[:, None, :2] - disc.position  # (N, M, 2)
            q = velocity[:, :, None, :] - disc.velocity  # (K, N, M, 2)
            t = np.clip(-(r * q).sum(-1) / (q * q).sum(-1), 0.0, p.horizon)
            closest = r + t[..., None] * q
            radius = problem.limits.radius + disc.radius + p.safety_margin
            f = np.maximum(1.0 - (closest * closest).sum(-1) / radius**2, -p.clip).reshape(len(c.v), -1)
            power = f
            for d in range(degree):
                out[:, j, d] = power.mean(axis=1)
                power = power * f
        return out

    return moments


@pytest.fixture(scope="session")
def least_times(measuring) -> Callable[..., dict]:
    """least_times({label: function}, seconds) -> least time [s] of each, all in turn until the time is up.

    In turn, as the machine's pace changes by the second; at least three rounds, or one where nothing is measured.
    """

    def measure(functions: dict, seconds: float) -> dict:
        least = dict.fromkeys(functions, np.inf)
        for function in functions.values():
            function()  # compiled, caches warm
        start, rounds = time.perf_counter(), 0
        while measuring and (rounds < 3 or time.perf_counter() - start < seconds):
            for label, function in functions.items():
                before = time.perf_counter()
                function()
                least[label] = min(least[label], time.perf_counter() - before)
            rounds += 1
        return least

    return measure


@pytest.fixture(scope="module")
def lines(request, measuring):
    """Lines that are printed when the module's benchmarks have run."""
    texts: list[str] = []
    yield texts
    if measuring and texts:
        capture = request.config.pluginmanager.get_plugin("capturemanager")
        with capture.global_and_fixture_disabled():
            print("\n" + "\n".join(texts))


@pytest.fixture(scope="session")
def limits() -> RobotLimits:
    return RobotLimits()
