"""Nobody is predicted to walk through a wall of the robot's map: where a wall is ahead, people turn along it before."""

import numpy as np
import pytest
from scipy import stats

import mjnav
from mjnav.messages import KnownMap, Track
from mjnav.robot.prediction import FIRST, GAP, SLOWEST, Crowd, TurningAtWalls, carry_people
from mjnav.scene.prediction import Prediction

NUM = 4000


def map_of(*walls):
    walls = np.array(walls, float).reshape(-1, 2, 2)
    return KnownMap(walls, np.full(len(walls), 0.1), np.zeros((0, 3)))


def crowd(known, *states, num=NUM, elapsed=0.1):
    samples = np.repeat(np.array(states, float)[:, None], num, axis=1)
    tracks = tuple(
        Track(f"person{i}", 2.0, one[None], np.ones(1), one, np.zeros((4, 4)), 1.0, 0.3)
        for i, one in enumerate(np.array(states, float))
    )
    return Crowd(tracks, samples, 2.0 + elapsed, known)


def predictor(seed=0):
    return TurningAtWalls(Prediction(horizon=4.0, step=0.1), seed)


@pytest.mark.parametrize("known", [None, map_of(), map_of([[50.0, -1.0], [50.0, 1.0]])])
def test_without_a_wall_near_everybody_walks_straight_on_to_the_last_bit(known):
    seen = crowd(known, [0.0, 0.0, 1.0, 0.3], [2.0, 1.0, 0.0, -0.8], num=7)
    found = predictor().predict(seen)
    position, velocity = carry_people(seen.samples, seen.elapsed)
    assert found.ahead is None
    assert (found.position == position).all()
    assert (found.velocity == velocity).all()


def test_a_turn_comes_before_the_wall_and_leads_along_it_at_the_same_speed():
    # At 45 degrees to a wall that is met after 3 s; the second person has none ahead, the third stands.
    seen = crowd(map_of([[-20.0, 3.0], [20.0, 3.0]]), [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.5, -0.5], [0.0, 2.9, 0.0, 0.2])
    paths = predictor().predict(seen).paths(0.1, 40)
    time = 0.1 * np.arange(41) + 0.1
    speed = np.sqrt(2.0)
    climbed = paths[0, :, -1, 1]  # at 1 m/s until the turn
    share = climbed / (3.0 - GAP / speed)
    assert stats.kstest(share, stats.uniform(FIRST, 1.0 - FIRST).cdf).pvalue > 1e-3
    along = np.diff(paths[0, :, -2:, 0], axis=1)[:, 0] / 0.1
    assert np.abs(along) == pytest.approx(speed)
    on = int((along > 0.0).sum())
    assert stats.binomtest(on, NUM, 0.5 * (1.0 + np.sqrt(0.5))).pvalue > 1e-3
    before = paths[0, :, :, 1] < climbed[:, None] - 1e-9
    straight = np.broadcast_to(time, before.shape)[before]
    assert paths[0, :, :, 0][before] == pytest.approx(straight)
    assert paths[1] == pytest.approx(np.broadcast_to(time[:, None] * [0.5, -0.5], paths[1].shape))
    assert SLOWEST > 0.2
    assert paths[2, :, -1, 1] == pytest.approx(2.9 + 0.2 * time[-1]), "who hardly moves turns nowhere"


def test_of_two_walls_the_nearer_counts_and_who_goes_straight_on_has_no_future():
    known = map_of([[5.0, -20.0], [5.0, 20.0]], [[2.0, -20.0], [2.0, 20.0]])
    found = predictor().predict(crowd(known, [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, -1.0, 0.0], num=200))
    assert found.paths(0.1, 40)[0, :, -1, 0].max() <= 2.0 - GAP + 1e-9
    assert found.turns.tolist() == [True, False]


@pytest.mark.parametrize("method", ["rkhs-plan", "mppi", "rkhs"])
def test_the_same_seed_predicts_the_same_and_the_model_is_the_default_of_methods_that_plan_in_time(method):
    seen = crowd(map_of([[-20.0, 3.0], [20.0, 3.0]]), [0.0, 0.0, 1.0, 1.0], num=50)
    one, same, other = (predictor(seed).predict(seen).ahead for seed in (3, 3, 4))
    assert (one == same).all()
    assert (one != other).any()
    given = {"time_limit": 6.0, "physics.engine": "kinematic"}
    default, named, straight = (
        mjnav.run(mjnav.load_scenario("blind_corner", {**given, **model}, controller=method), log=False)
        for model in ({}, {"prediction.model": "walls"}, {"prediction.model": "constant_velocity"})
    )
    poses = [end.trajectory.robot_pose.tobytes() for end in (default, named, straight)]
    assert poses[1] != poses[2]
    assert poses[0] == (poses[2] if method == "rkhs" else poses[1])


def test_people_who_come_round_a_corner_are_let_by():
    """Straight on they would walk into the wall, and the robot that believes it drives into them in 7 of 24 runs."""
    given = {"physics.engine": "kinematic", "layout.purpose": "training", "people_see_robot": False}
    ends = [
        mjnav.run(mjnav.load_scenario("blind_corner", given, controller="rkhs-plan", seed=seed), log=False)
        for seed in range(1000, 1006)
    ]
    assert [end.summary["outcome"] for end in ends] == ["goal"] * 6
