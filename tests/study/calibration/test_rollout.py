"""Rollouts of a control that is kept, against a fine simulation and closed forms."""

import numpy as np
import pytest
from scipy.stats import norm

from mjnav.messages import RobotLimits
from mjnav.motion.unicycle import ramp_mean
from mjnav.study.calibration import NUM_WINDOWS, share_of_rollouts

LIMITS = RobotLimits(radius=0.25)


def quiet(num: int = 1) -> np.ndarray:
    return np.zeros((num, NUM_WINDOWS, 2))


def touches(truth, control, noise) -> np.ndarray:
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
    hits = touches(truth, (0.8, 0.3), noise)
    found = [share_of_rollouts(truth, (0.8, 0.3), LIMITS, row[None]) == 1.0 for row in noise]
    assert 4 < hits.sum() < 20
    assert found == hits.tolist()
    assert share_of_rollouts(truth, (0.8, 0.3), LIMITS, noise) == pytest.approx(hits.mean())


def test_a_control_that_turns_is_kept_as_an_arc(known):
    ahead = known((0.0, 2.0, 0.0, 0.0, 0.2), twist=(1.0, 1.0))  # a circle of 1 m around (0, 1) passes here
    assert share_of_rollouts(ahead, (1.0, 1.0), LIMITS, quiet()) == 1.0
    assert share_of_rollouts(ahead, (1.0, 0.0), LIMITS, quiet()) == 0.0


def test_people_walk_on_for_five_seconds_and_no_longer(known):
    for distance, expected in ((4.9, 1.0), (5.1, 0.0)):
        coming = known((distance + 0.5, 0.0, -1.0, 0.0, 0.25), twist=(0.0, 0.0))
        assert share_of_rollouts(coming, (0.0, 0.0), LIMITS, quiet()) == expected


def test_noise_of_each_window_averages_over_the_way(known):
    # At 1 m/s with noise in v alone: the way after 5 s is 5 m + 0.1 s times the sum of 50 draws.
    noise = quiet(20_000)
    noise[..., 0] = np.random.default_rng(1).normal(scale=0.2, size=noise.shape[:2])
    std = 0.1 * np.sqrt(NUM_WINDOWS) * 0.2
    for excess in (-0.1, 0.0, 0.1):
        pillar = known((5.0 + excess + 0.5, 0.0, 0.0, 0.0, 0.25), twist=(1.0, 0.0))
        share = share_of_rollouts(pillar, (1.0, 0.0), LIMITS, noise)
        # The farthest point counts, which is before the end in a few rollouts.
        assert norm.sf(excess / std) - 0.01 < share < norm.sf((excess - 0.012) / std) + 0.015


def test_an_empty_room_is_safe(known):
    assert share_of_rollouts(known(), (1.0, 0.5), LIMITS, quiet()) == 0.0
