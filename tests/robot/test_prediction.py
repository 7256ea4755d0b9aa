"""Beliefs carried to the moment of effect, against fine simulations and against both engines."""

import numpy as np
import pytest
from scipy import stats

from mjnav.geometry.angles import wrap
from mjnav.noise import profile
from mjnav.robot.latency import CommandHistory, RobotPrediction, Stretch
from mjnav.robot.prediction import carry_people
from mjnav.world.simulator import Simulator

DELAYS = (0, 1, 3)


# ---------------------------------------------------------------------------- against the engines


def predictions(scenario, seed: int, duration: float, num: int = 1):
    """Yields predicted poses (num, 3) and the true one (3,) of each moment of effect under random commands.

    Without noise in the sensors the reading is the true pose, so the prediction starts from a point.
    """
    period, delay = scenario.control.period, scenario.control.delay
    limits = scenario.robot.limits
    simulator = Simulator(scenario, seed)
    history = CommandHistory(limits)
    predictor = RobotPrediction(scenario.noise.distributions(), limits, seed)
    rng = np.random.default_rng(seed)
    pending = {}
    reading = None
    for tick in range(round(duration / period)):
        truth = simulator.state().robot_pose
        reading = (simulator.sense() or (reading,))[-1]
        effect = (tick + delay) * period
        start = np.broadcast_to(reading.pose, (num, 3))
        pending[tick + delay], _ = predictor.robot(start, reading.time, effect, history.stretches(reading.time, effect))
        if tick in pending:
            yield pending.pop(tick), truth
        # Anywhere within the bounds: a ramp to it lasts several periods.
        command = rng.uniform([0.0, -limits.max_turn_rate], [limits.max_speed, limits.max_turn_rate])
        history.append(effect, command)
        simulator.advance(period, history.in_force(tick * period))


@pytest.mark.parametrize("rate", [5.0, 10.0, 50.0])
@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize(
    ("engine", "metres", "radians"),
    [
        ("mujoco", 2e-3, 7e-3),  # wheels settle behind their set-points
        ("kinematic", 1e-3, 2e-3),  # the base ramps in steps: a dt / 2 = 3 mrad/s for up to 0.6 s
    ],
)
def test_without_noise_the_predicted_pose_is_the_true_one_at_the_moment_of_effect(
    empty, engine, metres, radians, delay, rate
):
    scenario = empty(f"physics.engine={engine}", f"control.rate={rate}", f"control.delay={delay}", "noise.profile=none")
    errors = np.array([predicted[0] - truth for predicted, truth in predictions(scenario, 3, 4.0)])
    assert len(errors) > 4.0 * rate - 4
    assert np.hypot(errors[:, 0], errors[:, 1]).max() < metres
    assert np.abs(wrap(errors[:, 2])).max() < radians


ACTUATION_ONLY = (
    "noise.profile=none",
    'noise.actuation.v={distribution="pearson", std=0.05, skew=1.5, kurtosis=6.4}',
    'noise.actuation.omega={distribution="pearson", std=0.08, skew=-1.0, kurtosis=5.0}',
)


def ranks(scenario, seeds: range, *, reflected: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Where among the samples the truth lies, in [0, 1], along the samples' mean heading and in heading; (n,) each."""
    found = []
    for seed in seeds:
        for samples, truth in predictions(scenario, seed, 6.0, num=300):
            heading = wrap(samples[:, 2] - truth[2])
            along = (samples[:, :2] - truth[:2]) @ [np.cos(truth[2]), np.sin(truth[2])]
            if reflected:
                heading, along = 2.0 * heading.mean() - heading, 2.0 * along.mean() - along
            found.append(((along < 0.0).mean(), (heading < 0.0).mean()))
    return tuple(np.array(found).T)


@pytest.mark.parametrize("delay", [1, 3])
def test_with_noise_the_truth_is_one_of_the_samples(empty, delay):
    scenario = empty(f"control.delay={delay}", *ACTUATION_ONLY)
    for rank in ranks(scenario, range(20)):
        rank = rank[::delay]  # windows that do not overlap are independent
        assert stats.kstest(rank, "uniform").pvalue > 0.01
        assert 0.85 < ((rank > 0.05) & (rank < 0.95)).mean() < 0.95


# -------------------------------------------------------------------------------------- its noise


@pytest.fixture
def predictor(limits) -> RobotPrediction:
    return RobotPrediction(profile("pearson"), limits, 7)


def steady(start: float, end: float) -> list[Stretch]:
    """Straight on at 0.5 m/s."""
    return [Stretch(start, end, np.array([0.5, 0.0]), np.array([0.5, 0.0]))]


ORIGIN = np.zeros((4000, 3))


def travelled(pose: np.ndarray) -> np.ndarray:
    """Length of the arc to each pose from the origin; exact for a single one."""
    half = 0.5 * pose[:, 2]
    return np.hypot(pose[:, 0], pose[:, 1]) / np.sinc(half / np.pi)


def test_within_a_window_the_noise_holds_and_is_what_the_controller_gets(predictor):
    pose, noise = predictor.robot(ORIGIN, 0.2, 0.28, steady(0.2, 0.28))
    assert travelled(pose) == pytest.approx(0.08 * (0.5 + noise[:, 0]))
    assert pose[:, 2] == pytest.approx(0.08 * noise[:, 1])


def test_beyond_a_window_a_new_draw_holds(predictor):
    pose, noise = predictor.robot(ORIGIN, 0.24, 0.34, steady(0.24, 0.34))
    before = (pose[:, 2] - 0.04 * noise[:, 1]) / 0.06
    std = profile("pearson")["actuation.omega"].std
    assert before.std() == pytest.approx(std, rel=0.1)
    assert abs(np.corrcoef(before, noise[:, 1])[0, 1]) < 0.05


def test_people_walk_on_straight():
    samples = np.array([[1.0, 2.0, 0.5, -1.0], [0.0, 0.0, 0.0, 2.0]])
    position, velocity = carry_people(samples, 0.2)
    assert position == pytest.approx(np.array([[1.1, 1.8], [0.0, 0.4]]))
    assert np.array_equal(velocity, samples[:, 2:])
