"""When people reach the points of their routes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjnav.geometry.clearance import segment_distance
from mjnav.messages import Array, Trajectory
from mjnav.scenarios.people import REACHED
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Person, Scenario


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


def aggregated_time(trajectory: Trajectory, scenario: Scenario, *, outcome: str | None) -> float | None:
    """Sum of the times that the robot and all people whose route ends took to their goals [s].

    None where the robot did not reach its goal, where nobody's route ends, or where one of them has not arrived when
    the run ends. Source: Francis et al. (2023), table 1: the time that cooperative agents take to meet their goals.
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
