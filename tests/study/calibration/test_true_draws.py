"""Errors from the world's noise channels, and observations around the truth."""

import numpy as np
import pytest
from scipy import stats

from mjnav.noise import profile
from mjnav.study.calibration import ErrorDraws, Errors, around_truth

NUM = 20_000


def test_every_error_has_its_channels_distribution(person):
    errors = ErrorDraws(person(), 0, "fresh")(NUM)
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
        expected = noise[channel].sample(np.random.default_rng(1), NUM)
        assert stats.ks_2samp(column, expected).pvalue > 0.001, channel
    velocity = noise["detection.x"].sample(np.random.default_rng(2), NUM)
    for axis in (2, 3):
        assert stats.ks_2samp(errors.people[0, :, axis], velocity).pvalue > 0.001
    assert np.abs(np.corrcoef(errors.people[0].T) - np.eye(4)).max() < 0.04


def test_a_seed_and_a_use_have_their_own_draws(person):
    draws = [ErrorDraws(person(), seed, use)(5).pose for seed, use in ((0, "fresh"), (0, "fresh"), (1, "fresh"))]
    assert np.array_equal(draws[0], draws[1])
    assert not np.isclose(draws[0], draws[2]).any()
    assert not np.isclose(draws[0], ErrorDraws(person(), 0, "sample")(5).pose).any()


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


def test_a_known_state_is_the_truth_for_every_draw_of_the_control(known, true):
    noise = np.random.default_rng(0).normal(size=(7, 2))
    state = true((2.0, 1.0, -0.5, 0.25), pose=(1.0, 2.0, 3.0))
    o = around_truth(known((9.0, 9.0, 9.0, 9.0, 0.3)), state, Errors.of_control(noise, 1))
    assert np.array_equal(o.robot_pose, np.tile(state.robot_pose, (7, 1)))
    assert np.array_equal(o.control_noise, noise)
    assert np.array_equal(o.obstacles[0].position, state.people_position)
    assert np.array_equal(o.obstacles[0].velocity, state.people_velocity)
