"""The mixture of going on, stopping and turning."""

import numpy as np
import pytest

from mjnav.robot.estimation.base import person_track
from mjnav.robot.prediction import Crowd
from mjnav.robot.prediction.mixture import GOES_ON, LEFT, STOPS, Mixture, follow_targets, transition
from mjnav.scene.prediction import MixtureModel, Prediction

FOREVER = MixtureModel(stop_rate=0.0, turn_rate=0.0, sway=0.0)


def mixture(model=None, **prediction) -> Mixture:
    return Mixture(Prediction(**prediction), model or MixtureModel(), 3)


def crowd(*states, time=0.0, elapsed=0.0, num=50, names=None, spread=0.0):
    """People who are where `states` (x, y, vx, vy) say, each with samples about that."""
    rng = np.random.default_rng(1)
    samples = np.array(states)[:, None] + spread * rng.standard_normal((len(states), num, 4))
    names = names or [f"person{i}" for i in range(len(states))]
    tracks = tuple(
        person_track(name, time, 0.3, np.array([s, s])) for name, s in zip(names, np.array(states), strict=True)
    )
    return Crowd(tracks, samples, time + elapsed)


def walk(predictor, velocities, period=0.1, name="person0"):
    """The weights after each of the velocities."""
    x, found = np.zeros(2), []
    for k, v in enumerate(np.array(velocities, float)):
        x = x + period * v
        predictor.predict(crowd([*x, *v], time=k * period, names=[name]))
        found.append(predictor.modes[name].weights)
    return np.array(found)


def test_the_weight_moves_to_stops_when_the_person_stops_and_back_when_they_walk_on():
    slows = 1.2 * np.exp(-np.arange(1, 11) * 0.1 / 0.5)
    speeds = [1.2] * 20 + [*slows] + [0.0] * 10 + [*(1.2 - slows)] + [1.2] * 10
    weights = walk(mixture(), [(s, 0.0) for s in speeds])
    assert weights == pytest.approx(weights / weights.sum(axis=1, keepdims=True))
    assert weights[19, GOES_ON] > 0.9
    assert weights[27, STOPS] > 0.9  # 0.8 s after the first sign
    assert weights[39, STOPS] > 0.9  # and while they stand
    assert weights[-1, GOES_ON] > 0.9


def test_the_weight_moves_to_the_side_of_a_turn():
    angle = np.concatenate([np.zeros(10), 0.08 * np.arange(12)])
    weights = walk(mixture(), 1.2 * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    assert weights[-1, LEFT] > 0.5
    assert weights[-1].argmax() == LEFT


def test_without_stops_and_turns_everybody_goes_straight_on():
    people = crowd([0.0, 0.0, 1.0, 0.5], [2.0, 1.0, -0.3, 0.4], elapsed=0.15, spread=0.1)
    found = mixture(FOREVER).predict(people)
    times = 0.15 + 0.4 * np.arange(13)[:, None]
    x, v = people.samples[..., :2], people.samples[..., 2:]
    assert found.paths(0.4, 12) == pytest.approx(x[:, :, None] + times * v[:, :, None], abs=1e-12)
    assert found.velocity == pytest.approx(v, abs=1e-12)


def test_paths_are_those_of_a_fine_integration():
    rng = np.random.default_rng(0)
    state, first, second = rng.normal(size=(6, 4)), rng.normal(size=(6, 2)), rng.normal(size=(6, 2))
    change = np.array([0.0, 0.3, 0.37, 1.2, 5.0, np.inf])
    elapsed, step, tau, fine = np.full(6, 0.1), 0.4, 0.5, 2e-4
    paths, velocity = np.empty((6, 5, 2)), np.empty((6, 2))
    follow_targets(paths, velocity, state, first, second, change, np.zeros((6, 2)), elapsed, step, tau)
    x, v = state[:, :2].copy(), state[:, 2:].copy()
    for k in range(round(1.7 / fine) + 1):
        h = (k * fine - 0.1) / step
        if abs(h - round(h)) < 1e-6:
            assert paths[:, round(h)] == pytest.approx(x, abs=1e-3)
            assert round(h) > 0 or velocity == pytest.approx(v, abs=2e-3)
        acceleration = (np.where((k * fine >= change)[:, None], second, first) - v) / tau
        x, v = x + fine * v + 0.5 * fine**2 * acceleration, v + fine * acceleration


def test_of_people_who_walk_as_many_have_stopped_by_a_time_as_the_rate_says():
    model = MixtureModel(stop_rate=0.5, turn_rate=0.0, relaxation_time=0.05, sway=0.0)
    found = mixture(model, horizon=4.0, step=0.5).predict(crowd([0.0, 0.0, 1.0, 0.0], num=20_000))
    speed = np.diff(found.paths(0.5, 8)[0, :, :, 0], axis=1)[:, -1] / 0.5  # in the last half second, from 3.5 s on
    assert (speed < 0.1).mean() == pytest.approx(1.0 - np.exp(-0.5 * 3.4), abs=0.015)


def test_the_spread_of_a_straight_walk_is_that_of_a_velocity_that_diffuses():
    model = MixtureModel(stop_rate=0.0, turn_rate=0.0, sway=0.2)
    found = mixture(model).predict(crowd([0.0, 0.0, 1.0, 0.0], elapsed=0.2, num=20_000)).paths(0.4, 12)[0]
    times = 0.2 + 0.4 * np.arange(13)[:, None]
    assert found.std(axis=0) == pytest.approx(np.tile(0.2 * np.sqrt(times**3 / 3.0), 2), rel=0.03)


def test_transitions_are_probabilities():
    for interval in (0.0, 0.1, 5.0):
        found = transition(MixtureModel(), interval)
        assert (found >= 0.0).all()
        assert found.sum(axis=1) == pytest.approx(1.0)


def test_a_person_who_comes_anew_begins_anew():
    predictor = mixture()
    walk(predictor, [(1.0, 0.0)] * 5 + [(0.0, 0.0)] * 10)
    assert predictor.modes["person0"].weights[STOPS] > 0.5
    predictor.predict(crowd([5.0, 5.0, 0.0, 1.0], time=2.0, names=["person1"]))
    predictor.predict(crowd([0.0, 0.0, 0.0, 0.0], time=2.1))
    assert predictor.modes["person0"].weights[GOES_ON] == 1.0


def test_the_same_tracks_twice_are_one_reading():
    predictor = mixture()
    walk(predictor, [(1.0, 0.0)] * 3 + [(0.5, 0.0)])
    before = predictor.modes["person0"]
    predictor.predict(crowd([0.35, 0.0, 0.5, 0.0], time=before.time, elapsed=0.1))
    assert predictor.modes["person0"] is before
