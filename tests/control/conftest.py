"""Random observations: a robot near the origin among discs, walls and lanes, every belief skewed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mjnav.constraints import collision_cone, lane_distance, wall_clearance
from mjnav.control.registry import METHODS, make_controller
from mjnav.geometry.distances import segment_distance
from mjnav.messages import Lanes, Observation, ObstacleSamples
from mjnav.motion.unicycle import integrate, reachable

SMALL = {"num_v": 6, "num_omega": 7, "rollouts": 40, "num_turn_rates": 3}


def small_parameters(name: str) -> dict[str, int]:
    """Few candidates, or rollouts, for a method by name."""
    return {key: value for key, value in SMALL.items() if hasattr(METHODS[name].controller_class.parameters_type, key)}


@pytest.fixture(scope="session")
def small() -> Callable[[str], dict[str, int]]:
    """small(name) -> parameters of the method with few candidates or rollouts."""
    return small_parameters


@pytest.fixture(params=METHODS)
def controller(request, limits):
    """Every method."""
    return make_controller(request.param, limits, 0.1, **small_parameters(request.param))


@pytest.fixture(params=[name for name in METHODS if "num_v" in small_parameters(name)])
def choosing(request, limits):
    """A method that chooses from the grid of candidates."""
    return make_controller(request.param, limits, 0.1, **small_parameters(request.param))


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


@pytest.fixture(scope="session")
def constraint_samples() -> Callable[..., tuple[dict[int, np.ndarray], list[np.ndarray]]]:
    """constraint_samples(problem) -> f by column in reach, and of both lanes: (K, n), robot samples fastest."""

    def build(problem):
        o, p, radius = problem.observation, problem.parameters, problem.limits.radius
        omega, v = problem.candidates.omega[:, None], problem.candidates.v[:, None]
        heading = o.robot_pose[:, 2] + (omega + o.control_noise[:, 1]) * p.preview  # (K, N)
        direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
        velocity = (v + o.control_noise[:, 0])[..., None] * direction  # (K, N, 2)
        position = o.robot_pose[:, :2]
        columns, lanes = {}, []
        for j in problem.reach.discs:
            disc, combined = o.obstacles[j], radius + o.obstacles[j].radius + p.safety_margin
            f = collision_cone(
                position - disc.position[:, None],
                velocity[:, None] - disc.velocity[:, None],
                combined,
                form=p.form,
                horizon=p.horizon if np.isfinite(p.horizon) else None,
            ).reshape(len(v), -1)
            columns[j] = f / combined**2 if p.normalise else f
        for w in problem.reach.walls:
            combined = radius + p.safety_margin
            start, end = o.walls[w]
            f = wall_clearance(position, velocity, start, end, combined, p.wall_horizon)
            columns[len(o.obstacles) + w] = f / combined**2 if p.normalise else f
        if o.lanes is not None:
            after = position + velocity * p.lane_horizon
            lanes = [
                lane_distance(after, o.lanes.left) + o.lanes.left_offset + radius,
                -lane_distance(after, o.lanes.right) - o.lanes.right_offset + radius,
            ]
            lanes = [d / radius if p.normalise else d for d in lanes]
        return {j: np.maximum(f, -p.clip) for j, f in columns.items()}, [np.maximum(d, -p.clip) for d in lanes]

    return build


@pytest.fixture(scope="session")
def certain() -> Callable[..., Observation]:
    """certain(observation) -> the same, where every sample is the first one."""

    def build(observation):
        o, n = observation, len(observation.robot_pose)
        obstacles = tuple(
            replace(d, position=np.tile(d.position[0], (m, 1)), velocity=np.tile(d.velocity[0], (m, 1)))
            for d, m in ((d, len(d.position)) for d in o.obstacles)
        )
        lanes = o.lanes and replace(
            o.lanes,
            left_offset=np.full(n, o.lanes.left_offset[0]),
            right_offset=np.full(n, o.lanes.right_offset[0]),
        )
        pose, noise = np.tile(o.robot_pose[0], (n, 1)), np.tile(o.control_noise[0], (n, 1))
        return replace(o, robot_pose=pose, control_noise=noise, obstacles=obstacles, lanes=lanes)

    return build


@pytest.fixture(scope="session")
def drive() -> Callable[..., tuple[bool, float]]:
    """drive(controller, goal, heading=, discs=, walls=, known=, seconds=) -> whether it arrived, least clearance.

    A robot that starts at rest at the origin and does exactly what it decides, among discs (position, velocity, radius)
    that walk on and walls, all known exactly; `known` is its map. Every decision is checked to be within reach.
    """

    def run(controller, goal, *, heading=0.0, discs=(), walls=(), known=None, seconds=40.0) -> tuple[bool, float]:
        pose, twist, least = np.array([0.0, 0.0, heading]), np.zeros(2), np.inf
        goal, walls = np.array(goal, float), np.array(walls, float).reshape(-1, 2, 2)
        for tick in range(round(seconds / controller.period)):
            now = [(np.add(at, tick * controller.period * np.array(u)), np.array(u, float), r) for at, u, r in discs]
            gaps = [np.hypot(*(at - pose[:2])) - r for at, _, r in now]
            gaps += [float(segment_distance(pose[:2], *wall)) for wall in walls]
            least = min([least, *(gap - controller.limits.radius for gap in gaps)])
            if np.hypot(*(goal - pose[:2])) < 0.3:
                return True, least
            seen = tuple(ObstacleSamples(at[None], u[None], r) for at, u, r in now)
            time = tick * controller.period
            o = Observation(pose[None], np.zeros((1, 2)), twist, seen, goal, walls, time=time, map=known)
            decision = controller.decide(o)
            low, high = reachable(twist, controller.limits, controller.period)
            twist = np.array([decision.v, decision.omega])
            assert (low <= twist).all()
            assert (twist <= high).all()
            pose = integrate(pose, *twist, controller.period)
        return False, least

    return run
