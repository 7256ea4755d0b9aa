"""Random rooms to train in: people who cross the robot's way, and pillars. None of them is a scene that is reported."""

from dataclasses import replace

import numpy as np

import mjnav
from mjnav.scene.spec import ConstantVelocity, Person, Pillar, Scenario, Waypoints

EMPTY = mjnav.load_scenario(
    "crossing1", {"physics.engine": "kinematic", "physics.timestep": 0.01, "noise.profile": "pearson"}
)
SPEED = 0.8  # [m/s] of the robot on its way, for people who are to meet it
TIME_LIMIT = 20.0  # [s]

# Reaching the goal is worth 1, a collision costs 1, and a second 0.02; being near people costs as published. Progress
# tells a policy that stands still from one that nearly arrives.
REWARD = {"goal": 1.0, "collision": 4.0, "discomfort": 0.5, "progress": 0.05, "time": 0.02, "control": 0.005}


def random_scene(rng: np.random.Generator) -> Scenario:
    """Six to eight metres to the goal, one to four people of whom most would meet the robot, at most two pillars."""
    goal = (float(rng.uniform(6.0, 8.0)), float(rng.uniform(-1.5, 1.5)))
    people = tuple(_person(rng, goal) for _ in range(rng.integers(1, 5)))
    pillars = tuple(
        Pillar((float(goal[0] * s), float(goal[1] * s + rng.uniform(-1.0, 1.0))))
        for s in rng.uniform(0.3, 0.75, rng.integers(0, 3))
    )
    robot = replace(EMPTY.robot, start=(0.0, 0.0, float(rng.uniform(-0.6, 0.6))), goal=goal)
    return replace(EMPTY, name="training", robot=robot, people=people, pillars=pillars, time_limit=TIME_LIMIT)


def _person(rng: np.random.Generator, goal: tuple[float, float]) -> Person:
    """Walks straight through a point near the robot's way when the robot would be there, or back and forth across."""
    share = rng.uniform(0.25, 0.85)
    meeting = np.array(goal) * share + rng.normal(0.0, 0.4, 2)
    time = np.hypot(*goal) * share / SPEED
    angle, speed = rng.uniform(-np.pi, np.pi), rng.uniform(0.2, 1.0)
    if abs(angle) < 0.4:  # not from behind
        angle += np.pi
    velocity = speed * np.array([np.cos(angle), np.sin(angle)])
    start = meeting - velocity * time
    away = np.hypot(*start)
    if away < 2.0:  # nobody begins on top of the robot
        start *= 2.0 / max(away, 1e-3)
    if rng.random() < 0.25:
        behaviour = Waypoints((_pair(2.0 * meeting - start), _pair(start)), speed=speed)
    else:
        behaviour = ConstantVelocity(_pair(velocity))
    return Person(_pair(start), behaviour)


def _pair(point: np.ndarray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
