"""What a learned policy sees: exact in small cases, and the same wherever the world is put."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mjnav.control.parameters import LoopParameters
from mjnav.control.policy import PERSON, ROBOT, Actions, Encoder, Features, PolicyController, flatten
from mjnav.errors import InvalidValue
from mjnav.messages import KnownMap, Observation, ObstacleSamples, RobotLimits, Scan

EVERYTHING = Features(blocks=("robot", "people", "scan", "grid"), max_people=3, beams=4, cells=8, resolution=0.5)
LIMITS = RobotLimits(radius=0.2)


def person(*positions, velocity=(0.0, 0.0), radius=0.3) -> ObstacleSamples:
    at = np.array(positions, float)
    return ObstacleSamples(at, np.tile(np.array(velocity, float), (len(at), 1)), radius)


def observation(*people: ObstacleSamples, pillars=(), **changes) -> Observation:
    """A robot at (1, 2) that looks along +y, two samples 0.2 m apart across its heading; the goal is 3 m ahead."""
    discs = np.array([(*p.position[0], p.radius) for p in pillars]).reshape(-1, 3)
    given = {
        "robot_pose": np.array([[0.9, 2.0, 0.5 * np.pi], [1.1, 2.0, 0.5 * np.pi]]),
        "control_noise": np.zeros((2, 2)),
        "twist": np.array([0.5, -0.25]),
        "obstacles": (*people, *pillars),
        "goal": np.array([1.0, 5.0]),
        "scan": Scan(0.0, 2.0 * np.pi * np.arange(8) / 8 - np.pi, np.array([1, 2, 3, 4, 5, 6, np.inf, np.inf])),
        "map": KnownMap(np.zeros((0, 2, 2)), np.zeros(0), discs),
    }
    return Observation(**{**given, **changes})


def encoded(seen: Observation, features: Features = EVERYTHING) -> dict:
    return Encoder(features, LIMITS).encode(seen)


def test_the_robot_in_the_goal_frame():
    row = dict(zip(ROBOT, encoded(observation())["robot"].tolist(), strict=True))
    assert row["distance"] == 3.0
    assert (row["cos_heading"], row["sin_heading"]) == (1.0, 0.0)
    assert (row["v"], row["omega"]) == (0.5, -0.25)
    assert row["std_across"] == pytest.approx(0.1)
    assert (row["std_along"], row["std_heading"], row["corr_along_heading"]) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    left = encoded(observation(goal=np.array([-2.0, 2.0])))[
        "robot"
    ]  # 90 degrees to the left: the heading is to its right
    np.testing.assert_allclose(left[:3], [3.0, 0.0, -1.0], atol=1e-7)
    np.testing.assert_allclose(left[5:7], [0.1, 0.0], atol=1e-7)


def test_people_in_the_robots_frame_nearest_first_and_no_further_than_sight():
    far, near = person((1.0, 6.0), velocity=(0.0, -0.5)), person((2.9, 2.0), (3.1, 2.0), velocity=(0.4, 0.0))
    rows = encoded(observation(far, person((1.0, 13.0)), near, pillars=[person((1.5, 2.5))]))["people"]
    first, second = (dict(zip(PERSON, row.tolist(), strict=True)) for row in rows[:2])
    assert (first["x"], first["y"]) == pytest.approx((0.0, -2.0))  # to the right
    assert (first["vx"], first["vy"]) == pytest.approx((0.0, -0.4))
    assert first["clearance"] == pytest.approx(1.5)
    assert (first["std_x"], first["std_y"]) == pytest.approx((0.0, 0.1))
    assert (second["x"], second["y"], second["vx"]) == pytest.approx((4.0, 0.0, -0.5))
    assert rows[:, 0].tolist() == [1.0, 1.0, 0.0]
    assert not rows[2].any()


@pytest.mark.parametrize("numbers", [(9, 9, 9), (9, 4, 7)])
def test_a_persons_row_has_the_moments_of_the_samples_however_many_the_others_have(numbers):
    rng = np.random.default_rng(1)
    seen = [ObstacleSamples(rng.normal(0.1 * n, 1.0, (n, 2)), rng.normal(size=(n, 2)), 0.3) for n in numbers]
    rows = encoded(observation(*seen, robot_pose=np.zeros((2, 3))))["people"]
    expected = []
    for one in seen:
        at, (c, v) = one.position.mean(axis=0), (np.cov(x.T, bias=True) for x in (one.position, one.velocity))
        (sx, sy), (svx, svy) = np.sqrt(np.diag(c)), np.sqrt(np.diag(v))
        spread = sx, sy, c[0, 1] / (sx * sy), svx, svy, v[0, 1] / (svx * svy)
        expected.append([1.0, *at, *one.velocity.mean(axis=0), 0.3, np.hypot(*at) - 0.3 - LIMITS.radius, *spread])
    np.testing.assert_allclose(rows[:3], sorted(expected, key=lambda row: row[6]), rtol=1e-5, atol=1e-6)


def test_a_sector_has_its_least_range_and_sight_where_nothing_is_met():
    assert encoded(observation())["scan"].tolist() == [1.0, 3.0, 5.0, 10.0]


def test_before_the_first_scan_every_sector_has_sight():
    assert encoded(observation(scan=None))["scan"].tolist() == [10.0] * 4


def test_a_scan_of_a_lidar_off_the_centre_is_seen_from_the_centre():
    """A lidar 1 m ahead that looks to the left, with beams to the robot's right, ahead, left and back."""
    angles = 0.5 * np.pi * np.arange(-2, 2)
    scan = Scan(0.0, angles, np.array([2.0, 3.0, 4.0, np.inf]), mount=np.array([1.0, 0.0, 0.5 * np.pi]))
    sectors = encoded(observation(scan=scan))["scan"]
    assert sectors == pytest.approx([10.0, np.hypot(1, 2), 4.0, 10.0], rel=1e-6)


def test_the_grid_has_the_share_of_samples_that_cover_a_cell():
    # 8 x 8 cells of 0.5 m: cell (4, 4) has its centre 0.25 m ahead and 0.25 m to the left.
    grid = encoded(observation(person((1.0, 3.25), (6.0, 6.0), radius=0.1)))["grid"]
    assert grid[6, 3] == grid[6, 4] == 0.5
    assert grid.sum() == 1.0
    walls = np.array([[[-9.0, 3.3], [9.0, 3.3]]])
    np.testing.assert_array_equal(encoded(observation(walls=walls))["grid"].sum(axis=1), [0, 0, 0, 0, 0, 0, 8, 0])


def moved(seen: Observation, angle: float, shift: np.ndarray) -> Observation:
    """The whole world turned and shifted."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    pose = seen.robot_pose
    return replace(
        seen,
        robot_pose=np.column_stack([pose[:, :2] @ turn.T + shift, pose[:, 2] + angle]),
        goal=seen.goal @ turn.T + shift,
        walls=seen.walls @ turn.T + shift,
        obstacles=tuple(
            replace(o, position=o.position @ turn.T + shift, velocity=o.velocity @ turn.T) for o in seen.obstacles
        ),
    )


@pytest.mark.parametrize("angle", [0.7, 2.9, -1.8])
def test_nothing_changes_when_the_world_is_turned_and_shifted(angle):
    rng = np.random.default_rng(0)
    people = [ObstacleSamples(rng.normal((2.0, 3.0), size=(9, 2)), rng.normal(size=(9, 2)), 0.3) for _ in range(3)]
    seen = observation(*people, robot_pose=0.1 * rng.normal(size=(9, 3)), walls=rng.normal(size=(2, 2, 2)))
    here, there = encoded(seen), encoded(moved(seen, angle, np.array([-4.0, 7.5])))
    for name in here:
        np.testing.assert_allclose(here[name], there[name], atol=2e-6, err_msg=name)


def test_values_beyond_their_bounds_are_clipped():
    encoder = Encoder(EVERYTHING, LIMITS)
    wild = person((1e3, 0.0), (-1e3, 0.0), velocity=(50.0, 0.0), radius=5.0)
    blocks = encoder.encode(observation(wild, goal=np.array([1e4, 0.0]), twist=np.array([9.0, 9.0])))
    for name, (low, high) in encoder.bounds.items():
        assert blocks[name].dtype == np.float32
        assert ((low <= blocks[name]) & (blocks[name] <= high)).all(), name
    assert len(flatten(blocks)) == 11 + 3 * 13 + 4 + 64


def test_the_ends_of_an_action_are_the_robots_limits():
    actions = Actions(RobotLimits(max_speed=0.8, min_speed=-0.2, max_turn_rate=1.5))
    np.testing.assert_array_equal(actions.command([-1.0, -1.0]), [-0.2, -1.5])
    np.testing.assert_allclose(actions.command([1.0, 1.0]), [0.8, 1.5], rtol=1e-15)
    np.testing.assert_allclose(actions.command([0.0, 0.0]), [0.3, 0.0], atol=1e-15)


@pytest.mark.parametrize("limits", [RobotLimits(min_speed=-2.0, max_speed=0.1), RobotLimits(min_speed=-0.7)])
def test_no_action_from_minus_1_to_1_is_beyond_the_limits_by_rounding(limits):
    actions = Actions(limits)
    assert actions.command([1.0, 1.0]).tolist() == actions.high.tolist()
    for near in np.nextafter(1.0, 0.0) - np.arange(20) * 2.0**-53:
        assert (actions.command([near, near]) <= actions.high).all()
    assert (actions.command([1.01, 1.01]) > actions.high).all()


def test_a_robot_with_a_least_speed_may_still_stop():
    assert Actions(RobotLimits(min_speed=0.4)).command([-1.0, 0.0])[0] == 0.0


@pytest.mark.parametrize("action", [(-1.0, 0.3), (0.25, -0.75), (1.0, 1.0)])
def test_an_action_comes_back_from_its_command(action):
    actions = Actions(RobotLimits(max_speed=0.7))
    np.testing.assert_allclose(actions.action(actions.command(action)), action, atol=1e-15)


class Constant(PolicyController):
    features = ("robot", "people")
    action: Any = (0.5, 0.1)

    def act(self, blocks):
        assert sorted(blocks) == ["people", "robot"]
        return self.action


def constant(limits=LIMITS) -> Constant:
    return Constant(limits, 0.1, LoopParameters())


def test_a_policys_features_may_be_names_as_in_the_environment(monkeypatch):
    assert constant().decide(observation()).v == 0.5
    monkeypatch.setattr(Constant, "features", ("robots",))
    with pytest.raises(InvalidValue, match="did you mean 'robot'"):
        constant()


@pytest.mark.parametrize("returned", [None, 0.5, (0.5, 0.1, 0.0), (np.nan, 0.0), ("0.5", "0.1"), (1j, 0.0)])
def test_what_a_policy_returns_is_two_finite_numbers(returned, monkeypatch):
    monkeypatch.setattr(Constant, "action", returned)
    with pytest.raises(InvalidValue, match=r"^Constant\.act\(\): found .*; allowed: finite numbers, an array of shape"):
        constant().decide(observation())
