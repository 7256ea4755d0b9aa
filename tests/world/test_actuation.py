import numpy as np
import pytest

from mjnav.motion.unicycle import ramp_mean
from mjnav.world.actuation import Actuation


def test_the_ramp_is_the_one_by_which_commands_are_predicted(scene):
    scenario = scene()
    twists = Actuation(scenario, 0).twists((0.05, 1.2), 50)
    mean, end = ramp_mean((0.0, 0.0), (0.05, 1.2), scenario.robot.limits, 0.1)
    np.testing.assert_allclose(twists[-1], end, atol=1e-12)
    np.testing.assert_allclose(twists.mean(0), mean, atol=0.004)  # half a step of 3 rad/s^2


def test_commands_are_brought_within_the_bounds_but_the_robot_may_always_stop(scene):
    actuation = Actuation(scene(robot={"min_speed": 0.2}), 0)
    assert tuple(actuation.twists((9.0, -9.0), 2000)[-1]) == (1.0, -1.5)
    assert tuple(actuation.twists((-9.0, 0.0), 2000)[-1]) == (0.0, 0.0)


def test_each_window_has_one_draw_and_noise_is_not_limited(scene):
    actuation = Actuation(scene(profile="gaussian"), 3)
    draws = []
    for _ in range(200):
        actuation.open_window()
        twists = actuation.twists((0.0, 0.0), 5)
        assert (twists == twists[0]).all()
        draws.append(twists[0])
    assert np.std(draws, axis=0) == pytest.approx([0.05, 0.08], rel=0.2)
