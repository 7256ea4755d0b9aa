"""Predictions of 12 people, 20 steps ahead, by each model, against one decision of rkhs on 5 people.

    pytest benchmarks/test_prediction.py --benchmark-enable --benchmark-only

prints least times. Without the option each runs once.
"""

import numpy as np
import pytest

from mjnav.control import make_controller
from mjnav.messages import KnownMap
from mjnav.robot.estimation.base import person_track
from mjnav.robot.prediction import Crowd, make_predictor
from mjnav.scene import load

NUM_PEOPLE = 12
WALLS = np.array([[[-6.0, -3.5], [30.0, -3.5]], [[-6.0, 3.5], [30.0, 3.5]]])
MODELS = ("constant_velocity", "mixture", "social_force")
DECISION = "one decision, rkhs"


@pytest.fixture(scope="module")
def times(lines):
    """Least times [s] by name; printed, as shares of a decision, when all benchmarks have run."""
    least: dict[str, float] = {}
    yield least
    if DECISION in least:
        lines += [f"{name:36s} {1e3 * t:8.3f} ms {t / least[DECISION]:7.2f} x a decision" for name, t in least.items()]


def timed(benchmark, times, name, function, *, prepare=None):
    benchmark.pedantic(function, setup=prepare, rounds=100, warmup_rounds=2)
    if benchmark.stats is not None:
        times[name] = benchmark.stats.stats.min


def test_decision(benchmark, times, limits, approaching):
    controller, observation = make_controller("rkhs", limits, 0.1), approaching(25, 5)

    def forget():
        controller._latest = None

    timed(benchmark, times, DECISION, lambda: controller.decide(observation), prepare=forget)


@pytest.mark.parametrize("num", [25, 100])
@pytest.mark.parametrize("model", MODELS)
def test_prediction(benchmark, times, model, num):
    overrides = [f"prediction.model={model}", "prediction.horizon=4.0", "prediction.step=0.2"]
    predictor = make_predictor(load("crossing1", overrides), 0)
    rng = np.random.default_rng(0)
    place = rng.uniform((0.0, -3.0), (12.0, 3.0), (NUM_PEOPLE, 2))
    walk = np.column_stack([rng.choice([-1.2, 1.2], NUM_PEOPLE), rng.normal(0.0, 0.2, NUM_PEOPLE)])
    samples = np.hstack([place, walk])[:, None] + 0.1 * rng.standard_normal((NUM_PEOPLE, num, 4))
    floor = KnownMap(WALLS, np.array([0.2, 0.2]), np.zeros((0, 3)))
    count = iter(range(1, 10**6))

    def crowd():
        time = 0.1 * next(count)
        tracks = tuple(person_track(f"person{i}", time, 0.3, one) for i, one in enumerate(samples))
        return (Crowd(tracks, samples, time + 0.1, floor),), {}

    timed(benchmark, times, f"{model}, {num} samples", lambda c: predictor.predict(c), prepare=crowd)
