from dataclasses import replace

import numpy as np
import pytest

from mjnav.metrics import social
from mjnav.motion.social_force import FORMS, accelerations
from mjnav.scene.spec import Pillar, Wall
from tests.metrics.conftest import make_scenario, make_trajectory

LAW = FORMS["moussaid"]._replace(cut=100.0, drive=0.0, lookahead=0.0, obstacle_strength=0.0)


def pushed(position, velocity):
    """The force on each of two bodies by the kernel that people decide with, (2, 2)."""
    nothing = np.zeros((2, 2))
    everyone, seen = np.arange(2), np.ones(2, bool)
    return accelerations(
        np.array(position), np.array(velocity), np.full(2, 0.3), everyone, nothing, np.array(velocity), seen, -1,
        np.zeros((0, 3)), np.zeros((0, 6)), LAW,
    )  # fmt: skip


def test_the_law_is_the_one_that_people_decide_with():
    rng = np.random.default_rng(5)
    for position, velocity in zip(rng.normal(0.0, 1.5, (50, 2, 2)), rng.normal(0.0, 1.0, (50, 2, 2)), strict=True):
        on_first, on_second = pushed(position, velocity)
        found = social.pair_force(position[1] - position[0], velocity[0] - velocity[1])
        assert found == pytest.approx(on_first, rel=1e-9, abs=1e-12)
        assert -found == pytest.approx(on_second, rel=1e-9, abs=1e-12)


def test_forces_and_work_by_hand():
    # Everybody stands: D = e, B = gamma, theta = 0, so the force is A exp(-d / gamma) along e.
    people = np.tile([[1.0, 0.0], [-1.0, 0.0]], (3, 1, 1))
    people[1, 1] = np.nan  # one of them is away at the second tick
    things = {"walls": (Wall((-5.0, 2.0), (5.0, 2.0), 0.2),), "pillars": (Pillar((0.0, -4.0), radius=0.5),)}
    scenario = make_scenario(num_people=2, **things)
    found = social.social_forces(make_trajectory(np.zeros((3, 2)), people=people), scenario)
    one = 2.1 * np.exp(-1.0 / 0.35)
    work = 0.4 * one + 0.2 * 10.0 * np.exp(-(1.9 - 0.25) / 0.2)
    assert found == pytest.approx((0.1 * 3 * one, 0.1 * one, work))  # on the robot, those from both sides cancel


def test_without_people_there_are_none_and_without_things_none_of_theirs():
    assert social.social_forces(make_trajectory([[0, 0]] * 3), make_scenario()) is None
    scenario = replace(make_scenario(num_people=1))
    found = social.social_forces(make_trajectory([[0, 0]] * 3, people=[[[2.0, 0.0]]] * 3), scenario)
    assert found is not None
    on_people, on_robot, work = found
    assert work == on_people + on_robot
