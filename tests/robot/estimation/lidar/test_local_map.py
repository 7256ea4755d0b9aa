"""Driving by lidar without a map, or with one that lacks something: what is drawn, where the robot is, whom it sees."""

from dataclasses import replace

import numpy as np
import pytest

import mjnav
from mjnav.errors import InvalidValue
from mjnav.robot.estimation.base import error_at
from mjnav.scene.ways import floor_of_lidar

MAPLESS = {
    "physics.engine": "kinematic",
    "estimation.map.source": "lidar",
    "estimation.robot.source": "lidar",
    "estimation.obstacles.source": "lidar",
}
WALL_ACROSS = {
    **MAPLESS,
    "control.method": "rkhs-plan",
    "people": [],
    "robot.goal": [7.0, 0.0],
    "time_limit": 25.0,
    "walls": [
        {"from": [-1.0, -4.0], "to": [8.0, -4.0]},
        {"from": [-1.0, 4.0], "to": [8.0, 4.0]},
        {"from": [4.0, -1.5], "to": [4.0, 1.5]},
    ],
}
del WALL_ACROSS["estimation.map.source"]
ERROR = 0.1  # [m] of a range of 12 m and of the pose, together


@pytest.fixture(scope="module")
def driven():
    """A simulation of hall-lidar without a map, at its end."""
    scenario = mjnav.load_scenario("hall-lidar", MAPLESS, seed=2)
    with mjnav.Simulation(scenario, log=False) as simulation:
        while not simulation.done:
            simulation.step(simulation.decide())
        yield simulation


def test_it_gets_there_and_knows_where_it_is(driven):
    assert driven.summary["outcome"] == "goal"
    trajectory = driven.trajectory
    error = np.hypot(*(trajectory.robot_pose[:-1, :2] - trajectory.estimate[:, :2]).T)
    assert np.sqrt((error**2).mean()) < 0.05


def test_it_says_how_far_its_map_may_have_drifted(driven):
    """The stated region holds the true pose; without the map's drift, as the particles are, it would not."""
    assert driven.summary["robot_coverage"] > 0.8
    belief = driven.beliefs.robot
    assert np.sqrt(np.linalg.eigvalsh(belief.covariance[:2, :2])[1]) > 2.0 * belief.particles[:, :2].std(axis=0).max()


def test_an_error_of_a_pose_is_that_of_its_frame_seen_from_the_origin():
    """A scan placed with a small error is the scan placed rightly, moved by the frame's error."""
    pose, error, point = np.array([2.0, -1.0, 0.7]), 1e-6 * np.array([1.0, -2.0, 3.0]), np.array([0.5, 0.3])

    def placed(at, of):
        c, s = np.cos(at[2]), np.sin(at[2])
        return at[:2] + of @ np.array([[c, s], [-s, c]])

    expected = placed(error_at(-pose[:2]) @ error, placed(pose, point))
    np.testing.assert_allclose(placed(pose + error, point), expected, atol=1e-11)
    np.testing.assert_allclose(error_at(pose[:2]) @ error_at(-pose[:2]), np.eye(3), atol=1e-15)


def test_what_is_drawn_stands_there_and_nobody_who_walked_by_is_left(driven):
    seen = driven._robot._local.seen
    away = floor_of_lidar(with_map(driven.scenario)).clearance(seen[:, :2])
    people = driven.truth.people_position[~np.isnan(driven.truth.people_position[:, 0])]
    theirs = (np.hypot(*(seen[:, None, :2] - people).transpose(2, 0, 1)) < 0.5).any(axis=1)
    assert len(seen) > 200
    assert np.quantile(np.abs(away[~theirs]), 0.95) < ERROR


def with_map(scenario):
    return replace(scenario, estimation=replace(scenario.estimation, map=None))


def test_a_copy_goes_on_with_the_same_map(driven):
    scenario = mjnav.load_scenario("hall-lidar", MAPLESS, seed=3)
    with mjnav.Simulation(scenario, log=False) as one:
        for _ in range(20):
            one.step(one.decide())
        other = one.copy()
        for simulation in (one, other):
            for _ in range(10):
                simulation.step(simulation.decide())
        assert np.array_equal(one.truth.robot_pose, other.truth.robot_pose)
        assert np.array_equal(one._robot._local.seen, other._robot._local.seen)
        assert len(one._robot._local.seen) > 50


def test_a_log_of_it_replays_to_the_last_bit(tmp_path):
    log = tmp_path / "drive.mcap"
    mjnav.run(mjnav.load_scenario("hall-lidar", {**MAPLESS, "time_limit": 2.0}), log=log)
    assert mjnav.replay(log).identical


def test_a_wall_that_the_map_lacks_is_seen_and_driven_around():
    """By its map alone the robot stands before it: it brakes for what its method does not know of."""
    ends = {}
    for source in ("world", "both"):
        across = {**WALL_ACROSS, "estimation.map": {"source": source, "missing": ["wall2"]}}
        ends[source] = mjnav.run(mjnav.load_scenario("crossing1", across, seed=2), log=False).summary["outcome"]
    assert ends == {"world": "timeout", "both": "goal"}


@pytest.mark.parametrize(("key", "value"), [("missing", ["table0"]), ("shift", [0.1, 0.0, 0.0])])
def test_a_map_that_is_none_has_no_differences(key, value):
    with pytest.raises(InvalidValue, match=f"estimation.map.{key}: .*nothing where source is"):
        mjnav.load_scenario("hall-lidar", {"estimation.map": {"source": "lidar", key: value}})


def test_floor_that_beams_passed_is_seen_and_most_of_what_lies_behind_walls_is_not(driven):
    """A few beams are said to have gone farther than the walls."""
    unseen = driven._robot._local.unseen
    y = unseen.y + unseen.cell * np.arange(len(unseen.clearance))
    x = unseen.x + unseen.cell * np.arange(unseen.clearance.shape[1])
    along = (x > 5.0) & (x < 12.0)
    inside, behind = np.abs(y) < 2.8, (y > 3.5) & (y < 9.0)
    assert unseen.clearance[np.ix_(inside, along)].mean() < 0.05
    assert unseen.clearance[np.ix_(behind, along)].mean() > 0.6
