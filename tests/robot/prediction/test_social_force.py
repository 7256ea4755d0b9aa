"""Rollouts of social forces."""

import numpy as np
import pytest

from mjnav.messages import KnownMap
from mjnav.robot.estimation.base import person_track
from mjnav.robot.prediction import Crowd, RobotNow
from mjnav.robot.prediction.social_force import SocialForces
from mjnav.scene.prediction import Prediction, SocialForceModel


def rollout(*states, elapsed=0.0, floor=None, robot=None, step=0.4, samples=None, **model):
    """Paths (P, M, H + 1, 2) of people who are where `states` (x, y, vx, vy) say."""
    samples = np.array(states, float)[:, None] if samples is None else samples
    tracks = tuple(person_track(f"person{i}", 1.0, 0.3, one) for i, one in enumerate(samples))
    predictor = SocialForces(Prediction(step=step), SocialForceModel(**model), 0)
    return predictor.predict(Crowd(tracks, samples, 1.0 + elapsed, floor, robot)).paths(step, 12)


@pytest.mark.parametrize("form", ["moussaid_2009", "helbing"])
def test_who_walks_alone_goes_straight_on(form):
    samples = np.random.default_rng(0).normal(size=(1, 9, 4))
    found = rollout(samples=samples, elapsed=0.15, form=form)
    times = 0.15 + 0.4 * np.arange(13)[:, None]
    assert found == pytest.approx(samples[:, :, None, :2] + times * samples[:, :, None, 2:], abs=1e-9)


@pytest.mark.parametrize("form", ["moussaid_2009", "helbing"])
def test_two_who_walk_towards_each_other_part_and_go_on(form):
    a, b = rollout([0.0, 0.05, 1.2, 0.0], [6.0, -0.05, -1.2, 0.0], form=form, neighbour_range=6.0)[:, 0]
    gap = np.hypot(*(a - b).T)
    assert gap.min() > 0.4  # straight on they would be 0.1 m apart
    assert np.sign(a[-1, 1]) == -np.sign(b[-1, 1])
    assert a[-1, 0] > b[-1, 0]  # they have passed


def test_samples_of_the_crowd_meet_their_own_others_only():
    """Sample 0 of both is head-on; in sample 1 the other is far away."""
    samples = np.array([[[0.0, 0.05, 1.2, 0.0]] * 2, [[4.0, -0.05, -1.2, 0.0], [4.0, 50.0, -1.2, 0.0]]])
    (met, alone), _ = rollout(samples=samples, neighbour_range=6.0)
    assert np.abs(met[:, 1] - 0.05).max() > 0.1
    assert alone[:, 1] == pytest.approx(0.05, abs=1e-9)


def test_a_wall_a_pillar_and_the_robot_are_in_the_way():
    wall = KnownMap(np.array([[[3.0, -5.0], [3.0, 5.0]]]), np.array([0.2]), np.zeros((0, 3)))
    assert rollout([0.0, 0.0, 1.2, 0.0], floor=wall)[..., 0].max() < 2.9
    pillar = KnownMap(np.zeros((0, 2, 2)), np.zeros(0), np.array([[3.0, -0.05, 0.4]]))
    gap = np.hypot(*(rollout([0.0, 0.0, 1.2, 0.0], floor=pillar)[0, 0] - (3.0, -0.05)).T)
    assert gap.min() > 0.4
    robot = RobotNow(np.array([5.0, 0.02]), np.array([-0.8, 0.0]), 0.22)
    straight, aside = (rollout([0.0, 0.0, 1.2, 0.0], robot=robot, sees_robot=sees)[0, 0] for sees in (False, True))
    assert straight[:, 1] == pytest.approx(0.0, abs=1e-12)
    assert np.abs(aside[:, 1]).max() > 0.1


def test_shorter_substeps_lead_to_the_same_places():
    states = [0.0, 0.05, 1.2, 0.0], [5.0, -0.3, -1.2, 0.1], [2.0, 2.0, 0.2, -0.9]
    coarse, fine = rollout(*states, step=0.2), rollout(*states, step=0.05)
    assert coarse[:, :, 1:4] == pytest.approx(fine[:, :, 4:13:4], abs=0.05)
