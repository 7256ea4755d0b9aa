"""Each term of a reward against the definition that it is given by."""

import gymnasium
import numpy as np
import pytest

import mjnav.gym  # noqa: F401
from mjnav.gym.reward import TERMS, Transition
from mjnav.loop.prepare import load_scenario
from mjnav.messages import Contact, WorldState
from mjnav.metrics.effort import control_cost

SCENARIO = load_scenario("crossing1")  # robot 0.22 m, person 0.3 m in radius


def state(x: float, person: tuple[float, float], *contacts: Contact) -> WorldState:
    at = np.array([person], float)
    return WorldState(0.0, np.array([x, 0.0, 0.0]), np.zeros(2), at, np.zeros((1, 2)), contacts)


def step(before: WorldState, after: WorldState, outcome: str | None = None) -> Transition:
    return Transition(SCENARIO, before, after, np.array([10.0, 0.0]), np.zeros(2), np.array([0.1, 0.2]), outcome)


def value(name: str, transition: Transition) -> float:
    return TERMS[name].value(transition)


def test_discomfort_is_the_published_line_below_20_cm_and_sees_between_the_ends_of_a_step():
    far = step(state(0.0, (1.0, 0.0)), state(0.1, (1.0, 0.0)))
    assert value("discomfort", far) == 0.0
    near = step(state(0.0, (0.62, 0.0)), state(0.0, (0.62, 0.0)))
    assert value("discomfort", near) == pytest.approx(-0.1 + 0.5 * 0.1)
    passes = step(state(-1.0, (0.0, 0.62)), state(1.0, (0.0, 0.62)))  # 0.1 m in the middle of the step
    assert value("discomfort", passes) == pytest.approx(-0.05)


def test_who_comes_within_a_step_counts_where_they_are_after_it():
    comes = step(state(0.0, (np.nan, np.nan)), state(0.0, (0.62, 0.0)))
    assert comes.clearance == pytest.approx(0.1)
    assert step(comes.before, comes.before).clearance == np.inf


def test_sums_over_an_episode_are_the_metrics():
    weights = {"progress": 2.0, "time": 1.0, "control": 0.5}
    overrides = ("physics.engine=kinematic", "time_limit=3")
    env = gymnasium.make("mjnav/Scene-v0", scene="crossing1", overrides=overrides, reward=weights)
    _, info = env.reset(seed=2)
    start, rng = info["distance_to_goal_m"], np.random.default_rng(0)
    total, done = dict.fromkeys(weights, 0.0), False
    while not done:
        _, reward, terminated, truncated, info = env.step(rng.uniform(-1.0, 1.0, 2).astype(np.float32))
        assert reward == pytest.approx(sum(info["reward_terms"].values()))
        total = {name: total[name] + info["reward_terms"][name] for name in total}
        done = terminated or truncated
    decisions = env.unwrapped.simulation.trajectory.decision
    assert total["progress"] == pytest.approx(2.0 * (start - info["distance_to_goal_m"]))
    assert total["time"] == pytest.approx(-3.0)
    assert total["control"] == pytest.approx(-0.5 * control_cost(decisions, 0.1))
    env.close()
