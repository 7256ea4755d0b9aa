"""Small made-up trajectories with exact answers."""

from dataclasses import replace

import numpy as np
import pytest

from mjnav.messages import Trajectory, triangle
from mjnav.scene.spec import ConstantVelocity, Person, Robot, Scenario

PERIOD = 0.1


def make_trajectory(xy, *, people=None, period=PERIOD, **changes) -> Trajectory:
    """A robot that goes through the points xy (T + 1, 2), one a period, with perfect estimates and no commands."""
    xy = np.asarray(xy, float)
    rows, ticks = len(xy), len(xy) - 1
    people = np.zeros((rows, 0, 2)) if people is None else np.asarray(people, float)
    num_people = people.shape[1]
    pose = np.column_stack([xy, np.zeros(rows)])
    trajectory = Trajectory(
        time=np.arange(rows) * period,
        robot_pose=pose,
        robot_twist=np.zeros((rows, 2)),
        people_position=people,
        people_velocity=np.zeros_like(people),
        estimate=pose[:-1].copy(),
        estimate_triangle=np.tile(triangle(np.eye(3)), (ticks, 1)),
        tracks=np.concatenate([people[:-1], np.zeros((ticks, num_people, 2))], axis=-1),
        track_triangle=np.tile(triangle(np.eye(4)), (ticks, num_people, 1)),
        robot_ess=np.full(ticks, 500.0),
        robot_particles=np.full(ticks, 500.0),
        people_ess=np.full((ticks, num_people), 200.0),
        command=np.zeros((ticks, 2)),
        decision=np.zeros((ticks, 2)),
        nominal=np.full((ticks, 2), np.nan),
        status=("ok",) * ticks,
        contacts=(),
        timing=np.zeros((ticks, 7), np.int64),
        deadline_misses=0,
    )
    return replace(trajectory, **changes)


def make_scenario(*, start=(0.0, 0.0, 0.0), goal=(10.0, 0.0), num_people=0, waypoints=(), **changes) -> Scenario:
    robot = Robot(start=start, goal=None if waypoints else goal, waypoints=waypoints, radius=0.25)
    people = tuple(Person((5.0, 5.0), ConstantVelocity((0.0, 0.0)), radius=0.3) for _ in range(num_people))
    return Scenario(name="exact", robot=robot, people=people, **changes)


@pytest.fixture
def trajectory_through():
    return make_trajectory


@pytest.fixture
def scenario_with():
    return make_scenario
