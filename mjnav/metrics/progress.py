"""Progress along routes: when people reach the points of theirs, how far the robot went, and how far from its way.

The file also has the stretches of successive ticks at which something holds, and `by_blocks`, which goes through long
runs some rows at a time, so that intermediate results take little memory.
"""

from collections.abc import Callable, Sequence
from math import hypot

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry.distances import segment_distance
from mjnav.messages import Array, Trajectory
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, TABLE_1, Definition, figures
from mjnav.scene.people import REACHED
from mjnav.scene.ranges import Point
from mjnav.scene.spec import Person, Scenario

# -------------------------------------------------------------------- stretches and blocks of ticks


def stretches(holds: NDArray[np.bool_]) -> NDArray[np.intp]:
    """The first tick of each stretch of `holds` (T,), and the tick after its last, (n, 2)."""
    edges = np.diff(np.concatenate([[False], holds, [False]]).astype(np.int8))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])


ROWS = 4096


def by_blocks(function: Callable[..., Array], *columns: Array) -> Array:
    """The rows of function(*columns), for one that computes each row from the same row of its arguments alone."""
    starts = range(0, max(len(columns[0]), 1), ROWS)
    return np.concatenate([function(*(column[start : start + ROWS] for column in columns)) for start in starts])


# ---------------------------------------------------------------------------------- people's routes


def passings(person: Person, position: Array) -> NDArray[np.int64]:
    """The states at which the person first is within REACHED of each of their waypoints, in order: (n,) rows.

    `position` (T + 1, 2), NaN where they are not there; between two states they walk straight. As many as they reach,
    round after round where the route loops; none of a person without waypoints.
    """
    waypoints, loops = np.array(waypoints_of(person), float).reshape(-1, 2), _loops(person)
    rows: list[int] = []
    row = 0
    while len(waypoints) and (loops or len(rows) < len(waypoints)):
        near = _distance(waypoints[len(rows) % len(waypoints)], position[row:]) <= REACHED
        if not near.any():
            break
        row += int(near.argmax())
        rows.append(row)
        if loops and len(rows) > len(position):  # all waypoints are within reach at once
            break
    return np.array(rows, np.int64)


@figures(
    "ending",
    Definition("aggregated_time_s", better=LOWER, source=TABLE_1, words="time of all to their goals",
               null="nobody's route ends, or not all arrived"),
)  # fmt: skip
def aggregated_time(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> float | None:
    """Sum of the times that the robot and all people whose route ends took to their goals [s].

    None where the robot did not reach its goal, where nobody's route ends, or where one of them has not arrived when
    the run ends. Source: Francis et al. (2023), table 1: the time that cooperative agents take to meet their goals.

    * aggregated_time_s: sum of the times that the robot and all people whose route ends took to their goals
    """
    ending = [i for i, person in enumerate(scenario.people) if route_ends(person)]
    if outcome != "goal" or not ending:
        return None
    times = [float(trajectory.time[-1] - trajectory.time[0])]
    for i in ending:
        reached = passings(scenario.people[i], trajectory.people_position[:, i])
        if len(reached) < len(waypoints_of(scenario.people[i])):
            return None
        times.append(float(trajectory.time[reached[-1]] - trajectory.time[0]))
    return sum(times)


def route_ends(person: Person) -> bool:
    """Whether the person has waypoints, of which the last is a goal."""
    return bool(waypoints_of(person)) and not _loops(person)


def waypoints_of(person: Person) -> Sequence[Point]:
    """The points that the person walks through, of whatever behaviour; none of one without."""
    return getattr(person.behaviour, "waypoints", ())


def _loops(person: Person) -> bool:
    return len(waypoints_of(person)) > 1 and bool(getattr(person.behaviour, "loop", False))


def _distance(point: Array, position: Array) -> Array:
    """Of the point from the straight move that ends at each state, of the first from the state itself, (n,)."""
    apart = np.hypot(*(position - point).T)
    moves = segment_distance(point, position[:-1], position[1:])
    return np.concatenate([apart[:1], np.fmin(moves, apart[1:])])


# ---------------------------------------------------------------------------------- the robot's way


PROGRESS, PROGRESS_TIME = (
    0.1,
    5.0,
)  # [m] that the robot is to come nearer to its goal in [s]; Francis et al. (2023) leave them open


def way(scenario: Scenario) -> Array:
    """The corners from the start over the waypoints to the goal, (n, 2)."""
    return np.array([scenario.robot.start[:2], *scenario.robot.route])


def steps(corners: Array) -> Array:
    """The lengths of a polyline's sides (n - 1,) [m], from its corners (n, 2)."""
    return np.hypot(*np.diff(corners, axis=0).T)


def length(corners: Array) -> float:
    """The length of a polyline (n, 2) [m]."""
    return float(steps(corners).sum())


def farthest_step(scenario: Scenario) -> float:
    """[m] from tick to tick, beyond which a kidnapping put the robot elsewhere; infinite without any."""
    taken = scenario.faults is not None and scenario.faults.kidnappings
    return 2.0 * scenario.robot.max_speed * scenario.control.period if taken else np.inf


def jumps(trajectory: Trajectory, scenario: Scenario) -> NDArray[np.bool_]:
    """By which steps from tick to tick, (T,), a kidnapping put the robot elsewhere."""
    return steps(trajectory.robot_pose[:, :2]) > farthest_step(scenario)


@figures(
    "path",
    Definition("path_length_m", better=LOWER, equation=r"\sum_k \lvert p_{k+1} - p_k\rvert", source=TABLE_1),
)  # fmt: skip
def path_length(trajectory: Trajectory, scenario: Scenario) -> float:
    """The way that the robot's centre went [m].

    * path_length_m: length of the driven path, without kidnappings
    """
    driven = steps(trajectory.robot_pose[:, :2])
    return float(driven[~(driven > farthest_step(scenario))].sum())  # also of poses that are NaN


@figures("path", Definition("straight_line_m"))
def straight_line(scenario: Scenario) -> float:
    """The length of the way [m].

    * straight_line_m: length of the polyline from the start over the waypoints to the goal
    """
    return length(way(scenario))


@figures(
    "path",
    Definition("path_ratio", better=LOWER, words="path over straight line", null="a polyline without length"),
)  # fmt: skip
def path_ratio(trajectory: Trajectory, scenario: Scenario) -> float | None:
    """The path's length over the way's; None where the way has no length.

    * path_ratio: path_length_m / straight_line_m
    """
    straight = length(way(scenario))
    return path_length(trajectory, scenario) / straight if straight > 0.0 else None


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


@figures(
    "path",
    Definition("mean_deviation_m", words="mean deviation", equation=r"\frac{1}{t_T - t_0}\int \delta(t)\,dt"),
    Definition("max_deviation_m", words="greatest deviation", equation=r"\max_k \delta(t_k)"),
    better=LOWER,
)  # fmt: skip
def deviation(trajectory: Trajectory, scenario: Scenario) -> tuple[float, float]:
    """Mean over time (trapezoids) and maximum of the lateral distance from the way [m].

    * mean_deviation_m: lateral distance from the polyline of start, waypoints and goal, mean over time by trapezoids;
      beyond an end it is the distance from the line prolonged, so that being early or late is no deviation
    * max_deviation_m: lateral distance from the polyline of start, waypoints and goal, maximum
    """
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


@figures("ending", Definition("failures_to_progress", type=INTEGER, better=LOWER, source=TABLE_1, over_all=True))
def failures_to_progress(trajectory: Trajectory, scenario: Scenario) -> int:
    """How often the robot came no PROGRESS nearer to its goal, along the route, in PROGRESS_TIME.

    A failure that lasts counts once; the next begins only after the robot has come PROGRESS nearer. Source: Francis et
    al. (2023), table 1.

    * failures_to_progress: how often the robot came no 0.1 m nearer to the goal, along its route, in 5 s
    """
    left = way_left(trajectory, scenario)
    count, since, nearest, failed = 0, float(trajectory.time[0]), float(left[0]), False
    for time, distance in zip(trajectory.time.tolist(), left.tolist(), strict=True):
        if distance <= nearest - PROGRESS:
            since, nearest, failed = time, distance, False
        elif not failed and time - since >= PROGRESS_TIME - 1e-9:
            count, failed = count + 1, True
    return count


@figures(
    "path",
    Definition("spl", better=HIGHER, words="success weighted by path length", equation=r"S\,\ell / \max(\ell, L)",
               source="Anderson et al. (2018)", null="a polyline without length", over_all=True),
)  # fmt: skip
def spl(trajectory: Trajectory, scenario: Scenario, *, success: bool) -> float | None:
    """Success weighted by path length, S l / max(l, L), with L the path and l the way's length; None where l is 0.

    l is the polyline's length, not that of the shortest way around what stands in it. Source: Anderson et al., On
    Evaluation of Embodied Navigation Agents (2018).

    * spl: success weighted by path length: 0 without success, else straight_line_m over the longer of path_length_m and
      itself
    """
    straight = length(way(scenario))
    if straight == 0.0:
        return None
    return straight / max(straight, path_length(trajectory, scenario)) if success else 0.0
