"""The event's probability, rollouts of a control that is kept, errors of the world's noise, forecasts along runs."""

import numpy as np
import pytest
from scipy import stats

from mjnav import control
from mjnav.loop.episode import Episode
from mjnav.messages import Observation, ObstacleSamples, RobotLimits
from mjnav.motion.unicycle import ramp_mean
from mjnav.noise import profile
from mjnav.study import calibration as study
from mjnav.study.calibration import (
    NUM_WINDOWS,
    SETTINGS,
    CalibrationPlan,
    ErrorDraws,
    Errors,
    ForecastRecorder,
    around_truth,
    calibrate,
    forecasts,
    share_of_draws,
    share_of_pairs,
    share_of_rollouts,
)

LIMITS = RobotLimits(radius=0.25)


def random_samples(seed: int, num: int, sizes: tuple[int, ...]) -> Observation:
    rng = np.random.default_rng(seed)
    return Observation(
        robot_pose=rng.normal(scale=0.2, size=(num, 3)),
        control_noise=rng.normal(scale=0.1, size=(num, 2)),
        twist=np.zeros(2),
        obstacles=tuple(
            ObstacleSamples(
                np.array([2.0 + j, 0.4]) + rng.normal(scale=0.3, size=(m, 2)), rng.normal(scale=0.3, size=(m, 2)), 0.2
            )
            for j, m in enumerate(sizes)
        ),
        goal=np.ones(2),
        walls=np.array([[[0.5, -1.0], [0.5, 1.0]]]),  # right ahead, and of no account
    )


def touches(o: Observation, i: int, disc: ObstacleSamples, m: int, v: float, omega: float) -> bool:
    """Whether robot sample i and sample m of a disc come together: the distance at 20001 moments of 5 s."""
    heading = o.robot_pose[i, 2] + (omega + o.control_noise[i, 1]) * 0.4
    speed = v + o.control_noise[i, 0]
    time = np.linspace(0.0, 5.0, 20001)
    x = o.robot_pose[i, 0] - disc.position[m, 0] + time * (speed * np.cos(heading) - disc.velocity[m, 0])
    y = o.robot_pose[i, 1] - disc.position[m, 1] + time * (speed * np.sin(heading) - disc.velocity[m, 1])
    return bool(np.hypot(x, y).min() < 0.25 + disc.radius)


@pytest.mark.parametrize("seed", range(3))
def test_the_share_of_pairs_is_that_of_all_combinations_of_samples(seed):
    o = random_samples(seed, 4, (3, 1, 2))
    hits = 0
    combinations = [(i, a, b, c) for i in range(4) for a in range(3) for b in range(1) for c in range(2)]
    for i, *samples in combinations:
        hits += any(touches(o, i, disc, m, 0.7, 0.2) for disc, m in zip(o.obstacles, samples, strict=True))
    assert 0 < hits < len(combinations)
    assert share_of_pairs(o, (0.7, 0.2), LIMITS) == pytest.approx(hits / len(combinations))


@pytest.mark.parametrize("seed", range(3))
def test_the_share_of_draws_takes_sample_i_of_everything_together(seed):
    o = random_samples(seed, 30, (30, 1, 30))
    hits = [any(touches(o, i, d, min(i, len(d.position) - 1), 0.7, 0.2) for d in o.obstacles) for i in range(30)]
    assert 0 < sum(hits) < 30
    assert share_of_draws(o, (0.7, 0.2), LIMITS) == pytest.approx(sum(hits) / 30)


def quiet(num: int = 1) -> np.ndarray:
    return np.zeros((num, NUM_WINDOWS, 2))


def rolled_touches(truth, control, noise) -> np.ndarray:
    """Which of n rollouts touch, in steps of 2 ms, the set-point ramped in each."""
    step, (x, y, heading) = 2e-3, np.tile(truth.robot_pose.T, len(noise))
    before, hit = truth.twist, np.zeros(len(noise), bool)
    for k in range(50 * NUM_WINDOWS):
        set_point, before = ramp_mean(before, control, LIMITS, step)
        v, omega = (set_point + noise[:, k // 50]).T
        for disc in truth.obstacles:
            at = disc.position[0] + k * step * disc.velocity[0]
            hit |= np.hypot(x - at[0], y - at[1]) < 0.25 + disc.radius
        x, y, heading = x + step * v * np.cos(heading), y + step * v * np.sin(heading), heading + step * omega
    return hit


def test_rollouts_are_those_of_a_fine_simulation(known):
    truth = known((2.6, 1.5, 0.0, -0.3, 0.25), (1.0, -1.0, 0.0, 0.0, 0.1), pose=(0.1, -0.2, 0.3), twist=(0.2, -0.4))
    rng = np.random.default_rng(0)
    noise = rng.normal(scale=(0.3, 0.5), size=(24, NUM_WINDOWS, 2))
    noise += rng.normal(scale=(0.2, 0.3), size=(24, 1, 2))
    hits = rolled_touches(truth, (0.8, 0.3), noise)
    found = [share_of_rollouts(truth, (0.8, 0.3), LIMITS, row[None]) == 1.0 for row in noise]
    assert 4 < hits.sum() < 20
    assert found == hits.tolist()
    assert share_of_rollouts(truth, (0.8, 0.3), LIMITS, noise) == pytest.approx(hits.mean())


NUM_ERRORS = 20_000


def test_every_error_has_its_channels_distribution(person):
    errors = ErrorDraws(person(), 0, "fresh")(NUM_ERRORS)
    noise = profile("pearson")
    columns = {
        "pose.x": errors.pose[:, 0],
        "pose.y": errors.pose[:, 1],
        "pose.theta": errors.pose[:, 2],
        "actuation.v": errors.control[:, 0],
        "actuation.omega": errors.control[:, 1],
        "detection.x": errors.people[0, :, 0],
        "detection.y": errors.people[0, :, 1],
    }
    for channel, column in columns.items():
        expected = noise[channel].sample(np.random.default_rng(1), NUM_ERRORS)
        assert stats.ks_2samp(column, expected).pvalue > 0.001, channel
    velocity = noise["detection.x"].sample(np.random.default_rng(2), NUM_ERRORS)
    for axis in (2, 3):
        assert stats.ks_2samp(errors.people[0, :, axis], velocity).pvalue > 0.001
    assert np.abs(np.corrcoef(errors.people[0].T) - np.eye(4)).max() < 0.04


def test_the_state_is_the_truth_less_the_error_and_what_stands_stays(known, true):
    base = known((9.0, 9.0, 9.0, 9.0, 0.3), (4.0, 1.0, 0.0, 0.0, 0.2))
    state = true((2.0, 1.0, -0.5, 0.25), pose=(1.0, 2.0, 3.0))
    errors = Errors(np.array([[0.1, 0.2, -0.5]]), np.array([[0.01, 0.02]]), np.array([[[0.3, 0.4, 0.5, 0.6]]]))
    o = around_truth(base, state, errors)
    assert o.robot_pose[0] == pytest.approx([0.9, 1.8, 3.5 - 2.0 * np.pi])
    assert o.control_noise.tolist() == [[0.01, 0.02]]
    assert o.obstacles[0].position[0] == pytest.approx([1.7, 0.6])
    assert o.obstacles[0].velocity[0] == pytest.approx([-1.0, -0.35])
    assert o.obstacles[0].radius == 0.3
    assert o.obstacles[1] is base.obstacles[1]
    assert (o.twist is base.twist, o.goal is base.goal, o.time) == (True, True, state.time)


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


def test_more_fresh_draws_change_no_prediction_and_watching_changes_no_run(person):
    few, many = (forecasts(person(), CalibrationPlan(draws=draws)) for draws in (10, 1000))
    for setting in SETTINGS:
        assert np.array_equal(few[setting][:, 0], many[setting][:, 0])
    recorder = ForecastRecorder(person(), CalibrationPlan(draws=10))
    hashes = {Episode(person(), watch=watch).run().summary["state_hash"] for watch in (recorder, lambda record: None)}
    assert len(hashes) == 1


def test_methods_and_seeds_are_told_apart(person):
    scenarios = [person("time_limit=1.0", controller=method) for method in ("mean", "rkhs")]
    done = []
    found = calibrate(scenarios, range(3, 6), SHORT, progress=done.append)
    assert done == [1, 2, 3, 4, 5, 6]
    assert list(found) == ["mean", "rkhs"]
    for row in found.values():
        assert {setting: (c.count, c.num_groups) for setting, c in row.items()} == dict.fromkeys(SETTINGS, (15, 3))
    runs = np.concatenate(
        [forecasts(person("time_limit=1.0", seed=seed, controller="mean"), SHORT)["rollout"] for seed in (3, 4, 5)]
    )
    assert found["mean"]["rollout"].bias == pytest.approx((runs[:, 0] - runs[:, 1]).mean())
