"""Checks between the parts of a scenario: bodies that overlap, goals that cannot be reached.

A body is a disc or a rectangle seen from above. Walls may touch and cross (corners), a pillar may stand in a wall (half
column), and bodies may touch; every other overlap is refused, but that of two people at the start: they step apart
(`overlapping_people`). The robot fits under tables and meets their legs only; people, and bodies as high as the table,
meet its top.
"""

from itertools import combinations

from mjnav.errors import InvalidValue
from mjnav.scenarios.faults import check_kidnappings
from mjnav.scenarios.lidar import check_lidar
from mjnav.scenarios.routes import check_routes, check_trips
from mjnav.scenarios.shapes import (
    TOUCH,
    Box,
    Disc,
    leg_discs,
    met_by_people,
    met_by_robot,
    pillar_disc,
    top_box,
    wall_box,
)
from mjnav.scenarios.spec import Scenario


def check(scenario: Scenario, *, routes: bool = True) -> None:
    """Raises InvalidValue for the first pair of bodies that overlap, and for a goal that cannot be reached.

    Without `routes`, only for the robot's goals, not for people's.
    """
    robot = scenario.robot
    check_lidar(scenario.sensors.scanner, robot.radius, scenario.physics.timestep)
    walls = [wall_box(f"walls.{i}", wall) for i, wall in enumerate(scenario.walls)]
    tops = [top_box(f"tables.{i}", table) for i, table in enumerate(scenario.tables)]
    legs = [leg for i, table in enumerate(scenario.tables) for leg in leg_discs(f"tables.{i}", table)]
    pillars = [pillar_disc(f"pillars.{i}", pillar) for i, pillar in enumerate(scenario.pillars)]
    people = [Disc(f"people.{i}", p.start, p.radius) for i, p in enumerate(scenario.people)]

    for i, (top, table) in enumerate(zip(tops, scenario.tables, strict=True)):
        for other in (*(wall for wall in walls if wall.height >= top.height), *tops[:i]):
            if top.overlaps(other):
                raise InvalidValue(f"{top.key}.position", table.position, f"a place clear of {other.key}")
        for leg in leg_discs(top.key, table):
            for wall in walls:
                _keep_apart(leg, wall, f"{top.key}.position", table.position)
    for i, pillar in enumerate(pillars):
        for other in (*pillars[:i], *(top for top in tops if pillar.height >= top.height), *legs):
            _keep_apart(pillar, other, f"{pillar.key}.position", pillar.centre)
    around = met_by_people(scenario.walls, scenario.tables, scenario.pillars)
    for person in people:
        for other in around:
            _keep_apart(person, other, f"{person.key}.start", person.centre)
    if routes:
        check_routes(scenario.people, scenario.walls, scenario.tables, scenario.pillars)
    check_trips(scenario.people, scenario.walls, scenario.tables, scenario.pillars)
    body = Disc("robot", robot.start[:2], robot.radius)
    there = [disc for disc, person in zip(people, scenario.people, strict=True) if person.from_the_start]
    met = met_by_robot(scenario.walls, scenario.tables, scenario.pillars)
    for other in (*met, *there):
        _keep_apart(body, other, "robot.start", robot.start)
    check_kidnappings(scenario.faults, robot.radius, met)
    for i, point in enumerate(robot.route):
        for other in met:
            room = other.distance(point)
            if room <= 0.0 or room + robot.goal_tolerance < robot.radius:
                allowed = f"a point that the robot can reach to {robot.goal_tolerance:g} m, clear of {other.key}"
                raise InvalidValue(robot.route_key(i), point, allowed)


def overlapping_people(scenario: Scenario) -> list[tuple[int, int]]:
    """The pairs of people who overlap at the start, by their places in the scenario."""
    discs = [Disc("", person.start, person.radius) for person in scenario.people]
    there = [i for i, person in enumerate(scenario.people) if person.from_the_start]
    return [(i, j) for i, j in combinations(there, 2) if discs[i].radius - discs[j].distance(discs[i].centre) > TOUCH]


def _keep_apart(disc: Disc, other: Disc | Box, key: str, found: object) -> None:
    missing = disc.radius - other.distance(disc.centre)
    if missing > TOUCH:
        raise InvalidValue(key, found, f"a place clear of {other.key}, {missing:.3f} m further away")
