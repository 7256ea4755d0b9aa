"""Actions and commands."""

import numpy as np
import pytest

from mjnav.control.policy import Actions
from mjnav.messages import RobotLimits


def test_the_ends_of_an_action_are_the_robots_limits():
    actions = Actions(RobotLimits(max_speed=0.8, min_speed=-0.2, max_turn_rate=1.5))
    np.testing.assert_array_equal(actions.command([-1.0, -1.0]), [-0.2, -1.5])
    np.testing.assert_allclose(actions.command([1.0, 1.0]), [0.8, 1.5], rtol=1e-15)
    np.testing.assert_allclose(actions.command([0.0, 0.0]), [0.3, 0.0], atol=1e-15)


def test_a_robot_with_a_least_speed_may_still_stop():
    assert Actions(RobotLimits(min_speed=0.4)).command([-1.0, 0.0])[0] == 0.0


@pytest.mark.parametrize("action", [(-1.0, 0.3), (0.25, -0.75), (1.0, 1.0)])
def test_an_action_comes_back_from_its_command(action):
    actions = Actions(RobotLimits(max_speed=0.7))
    np.testing.assert_allclose(actions.action(actions.command(action)), action, atol=1e-15)
