"""How far the robot went, and how far from the way."""

from math import hypot

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry.clearance import segment_distance
from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import by_blocks
from mjnav.scenarios.spec import Scenario

PROGRESS, PROGRESS_TIME = (
    0.1,
    5.0,
)  # [m] that the robot is to come nearer to its goal in [s]; Francis et al. (2023) leave them open


def way(scenario: Scenario) -> Array:
    """The corners from the start over the waypoints to the goal, (n, 2)."""
    return np.array([scenario.robot.start[:2], *scenario.robot.route])


def length(corners: Array) -> float:
    """The length of a polyline (n, 2) [m]."""
    return float(np.hypot(*np.diff(corners, axis=0).T).sum())


def path_length(trajectory: Trajectory) -> float:
    """The way that the robot's centre went [m]."""
    return length(trajectory.robot_pose[:, :2])


def path_ratio(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """The path's length over the way's; None where the way has no length."""
    straight = length(way(scenario))
    return path_length(trajectory) / straight if straight > 0.0 else None


def lateral_distance(points: Array, corners: Array) -> Array:
    """Distance of points (..., 2) from the polyline `corners` (n, 2), to the side only [m].

    Beyond either end it is the distance from the line that goes on straight: to be late or early is no deviation.
    """
    moves = np.diff(corners, axis=0).any(axis=1)  # legs of no length have no direction and are left out
    corners = corners[np.concatenate([[True], moves])] if moves.any() else corners[:2]
    distance = segment_distance(points[..., None, :], corners[:-1], corners[1:])
    nearest = distance.argmin(-1)
    along = np.diff(corners, axis=0)
    size = np.hypot(*along.T)
    unit = np.divide(along, size[:, None], out=np.zeros_like(along), where=size[:, None] > 0.0)[nearest]
    relative = points - corners[nearest]
    ahead = (relative * unit).sum(-1)
    sideways = np.abs(unit[..., 0] * relative[..., 1] - unit[..., 1] * relative[..., 0])
    beyond = (nearest == 0) & (ahead < 0.0) | (nearest == len(along) - 1) & (ahead > size[nearest])
    return np.where(beyond, sideways, np.take_along_axis(distance, nearest[..., None], -1)[..., 0])


def deviation(trajectory: Trajectory, scenario: Scenario) -> tuple[float, float]:
    """Mean over time (trapezoids) and maximum of the lateral distance from the way [m]."""
    corners = way(scenario)
    distance = by_blocks(lambda points: lateral_distance(points, corners), trajectory.robot_pose[:, :2])
    duration = trajectory.time[-1] - trajectory.time[0]
    mean = np.trapezoid(distance, trajectory.time) / duration if duration > 0.0 else distance[0]
    return float(mean), float(distance.max())


def targets(trajectory: Trajectory, scenario: Scenario) -> NDArray[np.int64]:
    """Which point of the route each state makes for, (T + 1,): the next once one was reached within the tolerance."""
    route, reached = scenario.robot.route, 0
    found = []
    for x, y in trajectory.robot_pose[:, :2].tolist():
        goal_x, goal_y = route[reached]
        if reached < len(route) - 1 and hypot(x - goal_x, y - goal_y) <= scenario.robot.goal_tolerance:
            reached += 1
        found.append(reached)
    return np.array(found, np.int64)


def legs_behind(scenario: Scenario) -> Array:
    """The route behind each of its points, (n,) [m]; 0 behind the goal."""
    legs = np.hypot(*np.diff(np.array(scenario.robot.route), axis=0).T)
    return np.concatenate([np.cumsum(legs[::-1])[::-1], [0.0]])


def way_left(trajectory: Trajectory, scenario: Scenario) -> Array:
    """From each state straight to the point of the route that the robot makes for, and on along it, (T + 1,) [m]."""
    route, target = np.array(scenario.robot.route), targets(trajectory, scenario)
    return np.hypot(*(trajectory.robot_pose[:, :2] - route[target]).T) + legs_behind(scenario)[target]


def failures_to_progress(trajectory: Trajectory, scenario: Scenario) -> int:
    """How often the robot came no PROGRESS nearer to its goal, along the route, in PROGRESS_TIME.

    A failure that lasts counts once; the next begins only after the robot has come PROGRESS nearer. Source: Francis et
    al. (2023), table 1.
    """
    left = way_left(trajectory, scenario)
    count, since, nearest, failed = 0, float(trajectory.time[0]), float(left[0]), False
    for time, distance in zip(trajectory.time.tolist(), left.tolist(), strict=True):
        if distance <= nearest - PROGRESS:
            since, nearest, failed = time, distance, False
        elif not failed and time - since >= PROGRESS_TIME - 1e-9:
            count, failed = count + 1, True
    return count


def spl(trajectory: Trajectory, scenario: Scenario, *, success: bool) -> float | None:
    """Success weighted by path length, S l / max(l, L), with L the path and l the way's length; None where l is 0.

    l is the polyline's length, not that of the shortest way around what stands in it. Source: Anderson et al., On
    Evaluation of Embodied Navigation Agents (2018).
    """
    straight = length(way(scenario))
    if straight == 0.0:
        return None
    return straight / max(straight, path_length(trajectory)) if success else 0.0
