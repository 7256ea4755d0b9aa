"""Whether the robot can reach its goal between what stands in a scene."""

from itertools import pairwise
from typing import TYPE_CHECKING

from mjnav.errors import InvalidValue
from mjnav.scenarios.shapes import Strip, met_by_robot
from mjnav.scenarios.spec import Scenario

if TYPE_CHECKING:
    from mjnav.geometry.free_space import FreeSpace


def check_robot_way(scenario: Scenario) -> None:
    """Raises InvalidValue for the first point of the robot's route to which surely no way leads from its start.

    Each point counts as reached within the goal's tolerance. A gap that is up to 0.1 m too narrow for the robot is let
    pass: the grid does not tell it from one that is wide enough.
    """
    robot = scenario.robot
    points = [robot.start[:2], *robot.route]
    bodies = met_by_robot(scenario.walls, scenario.tables, scenario.pillars)
    strips = [Strip(start, end, 0.0, robot.radius) for start, end in pairwise(points)]
    if not any(strip.meets(body) for strip in strips for body in bodies):
        return
    cut_off = _space(scenario).first_cut_off(points, robot.radius, tolerance=robot.goal_tolerance)
    if cut_off is not None:
        place = max(cut_off, 1) - 1
        allowed = f"a point to which a way leads from {points[0]}, {robot.radius:g} m clear of walls, legs and pillars"
        raise InvalidValue(robot.route_key(place), robot.route[place], allowed)


def robot_has_a_way(scenario: Scenario, room: float = 0.0) -> bool:
    """Whether the robot can go from its start through its waypoints to its goal with `room` [m] on each side.

    Each point of the route counts as reached within the goal's tolerance.
    """
    robot = scenario.robot
    points = [robot.start[:2], *robot.route]
    return _space(scenario).connects(points, robot.radius + room, tolerance=robot.goal_tolerance)


def _space(scenario: Scenario) -> "FreeSpace":
    from mjnav.geometry.free_space import FreeSpace  # loads compiled code, which few scenes need here
    from mjnav.scenarios.floor import floor_of_robot

    points = [scenario.robot.start[:2], *scenario.robot.route]
    return FreeSpace.of(floor_of_robot(scenario.walls, scenario.tables, scenario.pillars), points)
