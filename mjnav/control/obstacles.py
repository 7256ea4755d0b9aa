"""Which discs and walls count in a decision, and their layout for the kernel."""

from dataclasses import dataclass

import numpy as np

from mjnav.control.parameters import Parameters
from mjnav.control.sample_cone import ConeBlocks
from mjnav.geometry.clearance import segment_distance
from mjnav.messages import Array, Observation, RobotLimits


@dataclass(frozen=True, slots=True)
class Reach:
    """Indices of the discs that count, nearest first, and of the walls; each in its own list of the observation."""

    discs: tuple[int, ...]
    walls: tuple[int, ...]


def in_reach(observation: Observation, mean: Array, limits: RobotLimits, parameters: Parameters) -> Reach:
    """Discs within sensing_range of the mean pose, at most max_obstacles, and walls that could matter.

    A wall farther off than the path of wall_horizon at top speed, plus the distance at which the clip cuts f off, gives
    the same samples for every candidate: it is left out.
    """
    p = parameters
    gaps = np.array([np.hypot(*(o.position.mean(0) - mean[:2])) - o.radius for o in observation.obstacles])
    order = np.argsort(gaps, kind="stable")
    discs = [int(j) for j in order if gaps[j] <= p.sensing_range][: p.max_obstacles]
    walls: list[int] = []
    if len(observation.walls):
        distance = segment_distance(
            observation.robot_pose[:, None, :2], observation.walls[:, 0], observation.walls[:, 1]
        )
        radius = limits.radius + p.safety_margin
        cut = radius * np.sqrt(1.0 + p.clip) if p.normalise else np.sqrt(radius**2 + p.clip)
        fastest = max(limits.max_speed, -limits.min_speed) + np.abs(observation.control_noise[:, 0]).max()
        reach = min(p.sensing_range, fastest * p.wall_horizon + cut)
        walls = [int(w) for w in np.flatnonzero(distance.min(axis=0) <= reach)]
    return Reach(tuple(discs), tuple(walls))


def sample_blocks(observation: Observation, reach: Reach, limits: RobotLimits, parameters: Parameters) -> ConeBlocks:
    """All N M pairs of every disc, and the robot's samples for every wall."""
    robot = observation.robot_pose
    discs = [observation.obstacles[j] for j in reach.discs]
    pairs = [(robot[None, :, :2] - o.position[:, None, :]).reshape(-1, 2) for o in discs]
    velocities = [np.repeat(o.velocity, len(robot), axis=0) for o in discs]
    radii = [limits.radius + o.radius + parameters.safety_margin for o in discs]
    return _blocks(observation, reach, pairs, velocities, radii, robot[:, :2], limits, parameters)


def mean_blocks(
    observation: Observation, reach: Reach, mean: Array, limits: RobotLimits, parameters: Parameters
) -> ConeBlocks:
    """One pair an obstacle: the mean robot against the mean disc."""
    discs = [observation.obstacles[j] for j in reach.discs]
    pairs = [(mean[:2] - o.position.mean(axis=0))[None] for o in discs]
    velocities = [o.velocity.mean(axis=0)[None] for o in discs]
    radii = [limits.radius + o.radius + parameters.safety_margin for o in discs]
    return _blocks(observation, reach, pairs, velocities, radii, mean[None, :2], limits, parameters)


def _blocks(
    observation: Observation,
    reach: Reach,
    pairs: list[Array],
    velocities: list[Array],
    radii: list[float],
    robot: Array,
    limits: RobotLimits,
    parameters: Parameters,
) -> ConeBlocks:
    num_discs, num_walls = len(reach.discs), len(reach.walls)
    pairs = [*pairs, *[robot] * num_walls]
    velocities = [*velocities, *[np.zeros_like(robot)] * num_walls]
    position = np.concatenate(pairs) if pairs else np.zeros((0, 2))
    velocity = np.concatenate(velocities) if velocities else np.zeros((0, 2))
    radius_squared = np.array([*radii, *[limits.radius + parameters.safety_margin] * num_walls]) ** 2
    wall = np.zeros((num_discs + num_walls, 4))
    if num_walls:
        wall[num_discs:] = observation.walls[list(reach.walls)].reshape(-1, 4)
    return ConeBlocks(
        column=np.array([*reach.discs, *(len(observation.obstacles) + w for w in reach.walls)], dtype=np.int64),
        start=np.cumsum([0, *(len(p) for p in pairs)]),
        num_discs=num_discs,
        x=np.ascontiguousarray(position[:, 0]),
        y=np.ascontiguousarray(position[:, 1]),
        vx=np.ascontiguousarray(velocity[:, 0]),
        vy=np.ascontiguousarray(velocity[:, 1]),
        radius_squared=radius_squared,
        unit=1.0 / radius_squared if parameters.normalise else np.ones_like(radius_squared),
        wall=wall,
    )
