"""Room for one more body of a random scene beside those that stand there already."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil, cos, hypot, sin

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.bodies import Pillar, Table, Wall
from mjnav.scenarios.floor import floor_of_people
from mjnav.scenarios.people import Person
from mjnav.scenarios.ranges import Point
from mjnav.scenarios.spec import Robot

ROBOT_ROOM = 0.1  # [m] around the robot's disc at its start, at each point of its route and on its way
PERSON_ROOM = 0.1  # [m] around a person at their start
ROBOT_TO_PERSON = 0.5  # [m] from a person's surface to the robot's at the start, unless the draft says more
_SPACING = 0.1  # [m] between the points that stand for a rectangle


@dataclass(slots=True)
class Room:
    """What has its place; `gap` is the least distance of drawn furniture from all else [m]."""

    gap: float
    walls: list[Wall] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    pillars: list[Pillar] = field(default_factory=list)
    people: list[Person] = field(default_factory=list)
    robot: Robot | None = None  # None until its place is known

    def for_wall(self, wall: Wall) -> bool:
        """Whether a wall keeps clear of furniture and of the robot; walls may cross."""
        points = _points(wall)
        furniture = floor_of_people((), self.tables, self.pillars).clearance(points)
        return bool(furniture.min() >= self.gap) and self._clear_of_robot(points, 0.0)

    def for_furniture(self, body: Table | Pillar) -> bool:
        """Whether a table or a pillar keeps the gap from all that stands there, and clear of the robot."""
        points, radius = (np.array([body.position]), body.radius) if isinstance(body, Pillar) else (_points(body), 0.0)
        least = floor_of_people(self.walls, self.tables, self.pillars).clearance(points).min() - radius
        return bool(least >= self.gap) and self._clear_of_robot(points, radius)

    def for_robot(self, robot: Robot) -> bool:
        """Whether the robot's start and route keep clear of walls and furniture, and its start of people."""
        points = [robot.start[:2], *robot.route]
        clearance = floor_of_people(self.walls, self.tables, self.pillars).clearance(points)
        people = all(_apart(robot.start, p.start) - p.radius - robot.radius >= ROBOT_TO_PERSON for p in self.people)
        return bool(clearance.min() >= robot.radius + ROBOT_ROOM) and people

    def for_person(self, person: Person, clear_of_robot: float | None) -> bool:
        """Whether a person's start keeps clear of all, and their waypoints of walls, furniture and the robot's goals.

        `clear_of_robot` [m] is the least distance of the centres; by default the surfaces are ROBOT_TO_PERSON apart.
        """
        floor = floor_of_people(self.walls, self.tables, self.pillars)
        waypoints: Sequence[Point] = getattr(person.behaviour, "waypoints", ())
        if floor.clearance(np.array([person.start, *waypoints])).min() < person.radius + PERSON_ROOM:
            return False
        if any(_apart(person.start, o.start) < person.radius + o.radius + PERSON_ROOM for o in self.people):
            return False
        if self.robot is None:
            return True
        both = person.radius + self.robot.radius
        least = both + ROBOT_TO_PERSON if clear_of_robot is None else max(both, clear_of_robot)
        ends = (person.start, *waypoints[-1:])  # where a person may stand
        return _apart(person.start, self.robot.start) >= least and all(
            _apart(end, goal) >= both for end in ends for goal in self.robot.route
        )

    def _clear_of_robot(self, points: Array, radius: float) -> bool:
        if self.robot is None:
            return True
        places = np.array([self.robot.start[:2], *self.robot.route])
        distance = np.hypot(*np.moveaxis(points[:, None] - places, -1, 0))
        return bool(distance.min() >= radius + self.robot.radius + ROBOT_ROOM)


def _points(body: Wall | Table) -> Array:
    """Points of a wall or a whole table as seen from above, (n, 2) [m]."""
    if isinstance(body, Wall):
        (x0, y0), (x1, y1) = body.start, body.end
        centre, along, across = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), hypot(x1 - x0, y1 - y0), body.thickness
        c, s = (x1 - x0) / along, (y1 - y0) / along
    else:
        centre, (along, across) = body.position, (side + 2.0 * body.leg_radius for side in body.size)
        c, s = cos(body.yaw), sin(body.yaw)
    u, v = (np.linspace(-0.5 * side, 0.5 * side, ceil(side / _SPACING) + 1) for side in (along, across))
    u, v = (grid.ravel() for grid in np.meshgrid(u, v))
    return np.stack([centre[0] + c * u - s * v, centre[1] + s * u + c * v], axis=1)


def _apart(one: Sequence[float], other: Sequence[float]) -> float:
    """Distance of two points in the plane [m]."""
    return hypot(one[0] - other[0], one[1] - other[1])
