"""Whether the robot can reach its goal, and people their waypoints, in what stands in a scene."""

from collections.abc import Iterable
from math import cos, hypot, sin

import numpy as np

from mjnav.geometry.free_space import FreeSpace
from mjnav.messages import Array
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.spec import Scenario

REACH = 1.2  # [m]; more than the widest robot or person, with the room that is asked for beside it


def robot_space(scenario: Scenario) -> FreeSpace:
    """What the robot's disc has to keep clear of: walls, pillars and the legs of tables, under whose tops it fits."""
    return _space(scenario, under_tables=True)


def person_space(scenario: Scenario) -> FreeSpace:
    """What a person has to keep clear of: walls, pillars and whole tables."""
    return _space(scenario, under_tables=False)


def robot_has_a_way(scenario: Scenario, room: float = 0.0, space: FreeSpace | None = None) -> bool:
    """Whether the robot can go from its start through its waypoints to its goal with `room` [m] on each side.

    Each point of the route counts as reached within the goal's tolerance. `space` is `robot_space(scenario)`, if known.
    """
    robot, space = scenario.robot, space or robot_space(scenario)
    points = [robot.start[:2], *robot.route]
    return space.connects(points, robot.radius + room, tolerance=robot.goal_tolerance)


def surfaces(bodies: Iterable[Wall | Table | Pillar], *, under_tables: bool) -> tuple[Array, Array]:
    """The discs (n, 3) and boxes (m, 6) of bodies, as `FreeSpace` has them; a table is its legs alone or a box."""
    discs: list[tuple[float, ...]] = []
    boxes: list[tuple[float, ...]] = []
    for body in bodies:
        if isinstance(body, Wall):
            (x0, y0), (x1, y1) = body.start, body.end
            length = hypot(x1 - x0, y1 - y0)
            along = ((x1 - x0) / length, (y1 - y0) / length)
            boxes.append((0.5 * (x0 + x1), 0.5 * (y0 + y1), *along, 0.5 * length, 0.5 * body.thickness))
        elif isinstance(body, Pillar):
            discs.append((*body.position, body.radius))
        elif under_tables:
            discs += [(float(x), float(y), body.leg_radius) for x, y in body.legs]
        else:
            half = (0.5 * body.size[0] + body.leg_radius, 0.5 * body.size[1] + body.leg_radius)
            boxes.append((*body.position, cos(body.yaw), sin(body.yaw), *half))
    return np.reshape(np.array(discs, float), (-1, 3)), np.reshape(np.array(boxes, float), (-1, 6))


def _space(scenario: Scenario, *, under_tables: bool) -> FreeSpace:
    bodies = (*scenario.walls, *scenario.tables, *scenario.pillars)
    discs, boxes = surfaces(bodies, under_tables=under_tables)
    ways = [getattr(person.behaviour, "waypoints", ()) for person in scenario.people]
    points = [scenario.robot.start[:2], *scenario.robot.route, *(p.start for p in scenario.people)]
    points += [point for way in ways for point in way]
    return FreeSpace.of(discs, boxes, points, reach=REACH)
