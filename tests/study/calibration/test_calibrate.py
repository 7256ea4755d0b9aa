"""Forecasts of risk along runs, and what choosing by them does to them."""

import numpy as np
import pytest

from mjnav import control
from mjnav.errors import InvalidValue
from mjnav.loop.episode import Episode
from mjnav.robot.controller import build_controller
from mjnav.study import calibration as study
from mjnav.study.calibration import (
    SETTINGS,
    CalibrationPlan,
    ErrorDraws,
    ForecastRecorder,
    around_truth,
    calibrate,
    forecasts,
    share_of_draws,
    share_of_pairs,
)

SHORT = CalibrationPlan(draws=200, every=2)


@pytest.mark.parametrize("method", control.names())
def test_every_method_is_judged_in_every_setting(person, method):
    found = forecasts(person("time_limit=1.0", controller=method), CalibrationPlan(draws=50, every=3))
    assert tuple(found) == SETTINGS
    for pairs in found.values():
        assert pairs.shape == (3, 2)  # ticks 0, 3 and 6 of 10; 9 would take effect at the end
        assert ((pairs >= 0.0) & (pairs <= 1.0)).all()


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_a_decision_is_judged_by_the_truth_of_the_moment_at_which_it_takes_effect(person, monkeypatch, delay):
    times = []

    def spy(observation, truth, errors):
        times.append((observation.time, truth.time))
        return around_truth(observation, truth, errors)

    monkeypatch.setattr(study, "around_truth", spy)
    forecasts(person(f"control.delay={delay}", "time_limit=1.0"), CalibrationPlan(draws=10, every=4))
    judged = [tick + delay for tick in (0, 4, 8) if tick + delay < 10]
    assert np.unique(times, axis=0) == pytest.approx(np.array([[0.1 * tick] * 2 for tick in judged]))


def test_what_the_world_does_is_known_without_noise(pillar):
    found = forecasts(pillar("noise.profile=none", controller="mean"), CalibrationPlan(draws=10, every=1))
    predicted, observed = found["direct"].T
    assert set(predicted) <= {0.0, 1.0}
    assert np.array_equal(predicted, observed)


def test_more_fresh_draws_change_no_prediction_and_watching_changes_no_run(person):
    few, many = (forecasts(person(), CalibrationPlan(draws=draws)) for draws in (10, 1000))
    for setting in SETTINGS:
        assert np.array_equal(few[setting][:, 0], many[setting][:, 0])
    recorder = ForecastRecorder(person(), CalibrationPlan(draws=10))
    hashes = {Episode(person(), watch=watch).run().summary["state_hash"] for watch in (recorder, lambda record: None)}
    assert len(hashes) == 1


def test_methods_and_seeds_are_told_apart_and_workers_are_of_no_account(person):
    scenarios = [person("time_limit=1.0", controller=method) for method in ("mean", "rkhs")]
    done = []
    found = calibrate(scenarios, range(3, 6), SHORT, progress=done.append)
    assert done == [1, 2, 3, 4, 5, 6]
    assert found == calibrate(scenarios, range(3, 6), SHORT, workers=2)
    assert list(found) == ["mean", "rkhs"]
    for row in found.values():
        assert {setting: (c.count, c.num_groups) for setting, c in row.items()} == dict.fromkeys(SETTINGS, (15, 3))
    runs = np.concatenate(
        [forecasts(person("time_limit=1.0", seed=seed, controller="mean"), SHORT)["rollout"] for seed in (3, 4, 5)]
    )
    assert found["mean"]["rollout"].bias == pytest.approx((runs[:, 0] - runs[:, 1]).mean())


# ------------------------------------------------------------------------- the optimiser's curse

NUM = 300


def differences(scenario, known, true, controls=None) -> np.ndarray:
    """Predicted share less frequency at the chosen control, or at a fixed one, over NUM draws of samples."""
    controller, limits = build_controller(scenario), scenario.robot.limits
    base, draws = known((4.0, 0.05, 0.0, 0.0, 0.25)), ErrorDraws(scenario, 0, "sample")
    fresh = around_truth(base, true(), ErrorDraws(scenario, 0, "fresh")(10_000))
    found = np.empty(NUM)
    for k in range(NUM):
        observation = around_truth(base, true(), draws(controller.parameters.samples))
        if controls is None:
            decision = controller.decide(observation)
            control = decision.v, decision.omega
        else:
            control = controls
        found[k] = share_of_pairs(observation, control, limits) - share_of_draws(fresh, control, limits)
    return found


def test_at_a_control_that_is_fixed_the_predicted_share_is_right_on_average(pillar, known, true):
    error = differences(pillar(), known, true, (0.8, 0.25))
    assert abs(error.mean()) < 4.0 * error.std() / np.sqrt(NUM) + 4.0 * 0.5 / np.sqrt(10_000)
    assert error.std() > 0.05  # 25 samples


def test_at_the_chosen_control_it_is_too_low(pillar, known, true):
    error = differences(pillar(controller="rkhs"), known, true)
    assert error.mean() < -4.0 * error.std() / np.sqrt(NUM)
    # More samples leave less to luck.
    better = differences(pillar("control.samples=200", controller="rkhs"), known, true)
    assert abs(better.mean()) < 0.5 * abs(error.mean())


@pytest.mark.parametrize("key", ["draws", "every"])
def test_a_plan_that_makes_no_sense_is_refused(key):
    with pytest.raises(InvalidValue, match=f"{key}: found 0; allowed: a whole number >= 1"):
        CalibrationPlan(**{key: 0})
