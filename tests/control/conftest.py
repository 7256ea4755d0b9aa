"""Random observations: a robot near the origin among discs, walls and lanes, every belief skewed."""

from collections.abc import Callable

import numpy as np
import pytest

from mjnav.messages import Lanes, Observation, ObstacleSamples


def _skewed(rng, size):
    """Zero mean, unit variance, skew 1.4."""
    return (rng.gamma(2.0, size=size) - 2.0) / np.sqrt(2.0)


def random_observation(
    seed: int,
    *,
    num_samples: int = 5,
    num_obstacles: int = 3,
    most: int = 6,
    num_walls: int = 2,
    lanes: bool = True,
    spread: float = 0.1,
    near: float = 1.0,
    far: float = 5.0,
) -> Observation:
    """`most` bounds M, which differs between obstacles; `spread` [m] is the beliefs' standard deviation."""
    rng = np.random.default_rng(seed)
    mean = np.array([*rng.normal(size=2), rng.uniform(-np.pi, np.pi)])
    pose = mean + spread * _skewed(rng, (num_samples, 3))
    obstacles = []
    for j in range(num_obstacles):
        m = 1 + (seed + 2 * j) % most
        angle, distance = rng.uniform(-np.pi, np.pi), rng.uniform(near, far)
        centre = mean[:2] + distance * np.array([np.cos(angle), np.sin(angle)])
        towards = (mean[:2] - centre) / distance
        position = centre + spread * _skewed(rng, (m, 2))
        velocity = 0.6 * towards + rng.normal(scale=0.3, size=2) + spread * _skewed(rng, (m, 2))
        obstacles.append(ObstacleSamples(position, velocity, float(rng.uniform(0.1, 0.4))))
    middles = mean[:2] + rng.uniform(-3.0, 3.0, size=(num_walls, 2))
    halves = rng.normal(size=(num_walls, 2))
    normal = rng.uniform(-np.pi, np.pi)
    a, b = 2.0 * np.cos(normal), 2.0 * np.sin(normal)
    c = -(a * mean[0] + b * mean[1])
    return Observation(
        robot_pose=pose,
        control_noise=np.array([0.05, 0.1]) * _skewed(rng, (num_samples, 2)),
        twist=np.array([rng.uniform(0.0, 1.0), rng.uniform(-1.5, 1.5)]),
        obstacles=tuple(obstacles),
        goal=mean[:2] + rng.normal(scale=4.0, size=2),
        walls=np.stack([middles - halves, middles + halves], axis=1),
        lanes=Lanes(
            left=(a, b, c - 2.0 * rng.uniform(0.3, 1.5)),
            right=(a, b, c + 2.0 * rng.uniform(0.3, 1.5)),
            left_offset=spread * _skewed(rng, num_samples),
            right_offset=spread * _skewed(rng, num_samples),
        )
        if lanes
        else None,
    )


@pytest.fixture(scope="session")
def observe() -> Callable[..., Observation]:
    """observe(seed, **sizes) -> a random observation."""
    return random_observation


@pytest.fixture(scope="session")
def alone() -> Callable[..., Observation]:
    """alone(twist=, heading=, goal=, num_samples=, **fields) -> a robot at the origin whose state is known exactly."""

    def build(*, twist=(0.5, 0.0), heading=0.0, goal=(5.0, 0.0), num_samples=25, obstacles=(), **fields) -> Observation:
        return Observation(
            robot_pose=np.tile([0.0, 0.0, heading], (num_samples, 1)),
            control_noise=np.zeros((num_samples, 2)),
            twist=np.array(twist, float),
            obstacles=tuple(obstacles),
            goal=np.array(goal, float),
            **fields,
        )

    return build
