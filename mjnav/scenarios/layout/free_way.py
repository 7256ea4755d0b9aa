"""Whether the robot can reach its goal between what stands in a scene."""

from mjnav.geometry.free_space import FreeSpace
from mjnav.scenarios.floor import floor_of_robot
from mjnav.scenarios.spec import Scenario


def robot_has_a_way(scenario: Scenario, room: float = 0.0) -> bool:
    """Whether the robot can go from its start through its waypoints to its goal with `room` [m] on each side.

    Each point of the route counts as reached within the goal's tolerance.
    """
    robot = scenario.robot
    points = [robot.start[:2], *robot.route]
    space = FreeSpace.of(floor_of_robot(scenario.walls, scenario.tables, scenario.pillars), points)
    return space.connects(points, robot.radius + room, tolerance=robot.goal_tolerance)
