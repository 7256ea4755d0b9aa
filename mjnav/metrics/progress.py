"""How far the robot went, and how far from the way."""

import numpy as np

from mjnav.geometry.clearance import segment_distance
from mjnav.messages import Array, Trajectory
from mjnav.metrics.blocks import by_blocks
from mjnav.scenarios.spec import Scenario


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
