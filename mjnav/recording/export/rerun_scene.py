"""What stands still in a rerun recording, the shapes of robot and people, and how far the robot is from all of them."""

from collections.abc import Sequence
from math import atan2, hypot

import numpy as np
import rerun as rr

from mjnav.geometry.clearance import segment_distance
from mjnav.messages import Array
from mjnav.recording.encode.scene import PERSON_HEIGHT, ROBOT_HEIGHT, TABLE_TOP
from mjnav.scenarios.spec import Scenario

_GREY, _WOOD, _GREEN = (140, 145, 153), (166, 115, 64), (38, 191, 77, 150)
_BLUE, _GHOST, _RED = (38, 102, 230), (32, 96, 255, 120), (230, 90, 64)


def about_z(heading: float) -> rr.Quaternion:
    """The turn by `heading` [rad]."""
    return rr.Quaternion(xyzw=[0.0, 0.0, np.sin(0.5 * heading), np.cos(0.5 * heading)])


def log_scene(stream: rr.RecordingStream, scenario: Scenario) -> None:
    """Walls, tables, pillars and goals, for all times."""
    walls = scenario.walls
    if walls:
        ends = [(np.array(wall.start), np.array(wall.end), wall) for wall in walls]
        boxes = rr.Boxes3D(
            centers=[[*(0.5 * (a + b)), 0.5 * wall.height] for a, b, wall in ends],
            half_sizes=[[0.5 * hypot(*(b - a)), 0.5 * wall.thickness, 0.5 * wall.height] for a, b, wall in ends],
            quaternions=[about_z(atan2(*(b - a)[::-1])) for a, b, wall in ends],
            colors=[_GREY] * len(walls),
        )
        stream.log("world/walls", boxes, static=True)
    for i, table in enumerate(scenario.tables):
        leg_height = table.height - TABLE_TOP
        legs = rr.Cylinders3D(
            lengths=[leg_height] * 4,
            radii=[table.leg_radius] * 4,
            centers=[[*leg, 0.5 * leg_height] for leg in table.legs.tolist()],
            colors=[_WOOD] * 4,
        )
        top = rr.Boxes3D(
            centers=[[*table.position, table.height - 0.5 * TABLE_TOP]],
            half_sizes=[[*(0.5 * side + table.leg_radius for side in table.size), 0.5 * TABLE_TOP]],
            quaternions=[about_z(table.yaw)],
            colors=[_WOOD],
        )
        stream.log(f"world/tables/table{i}/legs", legs, static=True)
        stream.log(f"world/tables/table{i}/top", top, static=True)
    for i, pillar in enumerate(scenario.pillars):
        centre = [*pillar.position, 0.5 * pillar.height]
        shape = rr.Cylinders3D(lengths=[pillar.height], radii=[pillar.radius], centers=[centre], colors=[_GREY])
        stream.log(f"world/pillars/pillar{i}", shape, static=True)
    robot = scenario.robot
    goals = rr.Cylinders3D(
        lengths=[0.02] * len(robot.route),
        radii=[robot.goal_tolerance] * len(robot.route),
        centers=[[x, y, 0.01] for x, y in robot.route],
        colors=[_GREEN] * len(robot.route),
    )
    stream.log("world/goal", goals, static=True)


def log_bodies(stream: rr.RecordingStream, scenario: Scenario) -> None:
    """The robot, where it is and where it believes to be, and the people: shapes that their poses move."""
    radius = scenario.robot.radius
    for name, color in (("truth", _BLUE), ("estimate", _GHOST)):
        centre = [0.0, 0.0, 0.5 * ROBOT_HEIGHT]
        body = rr.Cylinders3D(lengths=[ROBOT_HEIGHT], radii=[radius], centers=[centre], colors=[color])
        stream.log(f"world/robot/{name}", body, static=True)
    for i, person in enumerate(scenario.people):
        body = rr.Cylinders3D(
            lengths=[PERSON_HEIGHT],
            radii=[person.radius],
            centers=[[0.0, 0.0, 0.5 * PERSON_HEIGHT]],
            colors=[_RED],
            labels=[f"person{i}"],
        )
        stream.log(f"world/people/person{i}", body, static=True)


def clearance(scenario: Scenario, robot: Array, people: Sequence[Array]) -> Array:
    """Distance from the robot's surface to the nearest other one at each moment [m], (T,); inf in an empty room.

    `robot` is (T, 3), and each of `people` (T, 2) or more columns, of which the first two count.
    """
    places = robot[:, :2]
    nearest = np.full(len(places), np.inf)
    for person, found in zip(scenario.people, people, strict=True):
        nearest = np.fmin(nearest, np.hypot(*(places - found[:, :2]).T) - person.radius)  # NaN: not there
    discs = [(leg, table.leg_radius) for table in scenario.tables for leg in table.legs]
    discs += [(np.array(pillar.position), pillar.radius) for pillar in scenario.pillars]
    for centre, radius in discs:
        nearest = np.minimum(nearest, np.hypot(*(places - centre).T) - radius)
    for wall in scenario.walls:
        corners = _corners(np.array(wall.start), np.array(wall.end), wall.thickness)
        edges = [segment_distance(places, corners[i], corners[(i + 1) % 4]) for i in range(4)]
        nearest = np.minimum(nearest, np.min(edges, axis=0))
    return nearest - scenario.robot.radius


def _corners(start: Array, end: Array, thickness: float) -> Array:
    """Of a wall, (4, 2), in order."""
    along = (end - start) / hypot(*(end - start))
    across = 0.5 * thickness * np.array([-along[1], along[0]])
    return np.array([start + across, end + across, end - across, start - across])
