"""Logs of robots that go by their lidar, with made-up beliefs."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import mjnav
from mjnav.loop.prepare import load_scenario
from mjnav.messages import Beliefs, Detection, RobotBelief, Track
from mjnav.scene.spec import Scenario

ERROR = np.array([0.1, -0.05, 0.02])  # of the believed pose [m, m, rad]


def by_lidar(overrides: dict) -> Scenario:
    """hall without physics, its robot and people estimated from scans."""
    scenario = load_scenario("hall", {"physics.engine": "kinematic", "time_limit": 1.0, **overrides}, seed=3)
    robot, people = (replace(one, source="lidar") for one in (scenario.estimation.robot, scenario.estimation.obstacles))
    return replace(scenario, estimation=replace(scenario.estimation, robot=robot, obstacles=people))


def write_log(path: Path, scenario: Scenario) -> None:
    """A second in which the robot is believed to be ERROR away, and person i is track 3 + i, or from 0.5 s on 13 + i.

    Even tracks coast. Each detection lies where its person is.
    """
    with mjnav.Simulation(scenario, estimators=False, log=path) as simulation:
        while not simulation.done:
            truth, time = simulation.truth, simulation.time
            mean, weights = truth.robot_pose + ERROR, np.full(20, 0.05)
            robot = RobotBelief(time, np.tile(mean, (20, 1)), weights, mean, 1e-4 * np.eye(3), 20.0)
            tracks, found = [], []
            for i, position in enumerate(truth.people_position):
                state = np.array([*position, 0.0, 0.0])
                name, age = (f"track{3 + i}", time) if time < 0.45 else (f"track{13 + i}", time - 0.5)
                cloud = np.tile(state, (20, 1))
                life = {"age": age + 1.0, "unseen": 0.3 * (i % 2 == 0)}
                tracks.append(Track(name, time, cloud, weights, state, 1e-2 * np.eye(4), 20.0, 0.3, **life))
                found.append(Detection(time, position, np.diag([0.01, 0.04]), 0.25, 9))
            simulation.observe(Beliefs(robot, tuple(tracks), tuple(found)))
            simulation.step(0.5, 0.4)
