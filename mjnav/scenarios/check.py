"""Checks of a scenario before a run: keys without effect, memory, a way for the robot, overlapping bodies.

A key has no effect where another value replaces its value. Such keys are refused before a run. The scenario in a log
may have them, so that logs of earlier versions can be read.

The memory that a run takes is estimated before the run starts. The way of the robot leads between the bodies of the
scene to its goal.

For the check of overlaps a body is a disc or a rectangle seen from above. Walls may touch and cross (corners), a pillar
may stand in a wall (half column), and bodies may touch. Every other overlap is refused, except that of two people at
the start: they step apart (`overlapping_people`). The robot fits under tables and meets their legs only; people, and
bodies as high as the table, meet its top.
"""

from itertools import combinations, pairwise
from typing import TYPE_CHECKING

from mjnav.errors import InvalidValue
from mjnav.scenarios.bodies import (
    TOUCH,
    Box,
    Disc,
    Strip,
    leg_discs,
    met_by_people,
    met_by_robot,
    pillar_disc,
    top_box,
    wall_box,
)
from mjnav.scenarios.faults import check_kidnappings
from mjnav.scenarios.latency import Latency
from mjnav.scenarios.sensors import check_lidar
from mjnav.scenarios.spec import Control, Scenario
from mjnav.scenarios.ways import check_routes, check_trips

if TYPE_CHECKING:
    from mjnav.geometry.floor import FreeSpace


# ------------------------------------------------------------------------------ keys without effect


def refuse_idle(scenario: Scenario) -> None:
    """Raises InvalidValue for the first such value; a default may stand there, as `dumps` writes them all."""
    for key in ("robot", "obstacles"):
        choice = getattr(scenario.estimation, key)
        if choice.source == "direct" and choice.filter != type(choice)().filter:
            raise InvalidValue(f"estimation.{key}.filter", choice.filter, 'no filter where source is "direct"')
    lidar = scenario.sensors.lidar
    if lidar is not None and lidar.mixed and not scenario.sensors.scanner.beam_width:
        raise InvalidValue("sensors.lidar.mixed", lidar.mixed, "no mixed pixels where beam_width is 0")
    robot = scenario.estimation.robot
    if robot.start is not None and robot.source != "lidar" and robot.localizer is None:
        raise InvalidValue("estimation.robot.start", robot.start, 'no start where source is not "lidar"')
    delay, latency = scenario.control.delay, scenario.control.latency
    if latency is None:
        return
    if delay != Control().delay:
        raise InvalidValue("control.delay", delay, "delay or latency, not both")
    if latency.model == "measured" and latency.order != Latency("measured").order:
        raise InvalidValue("control.latency.order", latency.order, 'an order for model "sampled" only')


# ------------------------------------------------------------------------------------------- memory


MAX_BYTES = 8e9  # what a small machine has
_TICK = 256  # [bytes] of a tick's row in the trajectory: times, poses, controls, timing
_TICK_OF_PERSON = 192  # [bytes] of each person in a tick: truth, belief and its covariance
# [bytes] of a particle, measured with a log: state, weight, prediction, errors, likelihoods, logged data
_PARTICLE = 300


def check_memory(scenario: Scenario) -> None:
    """Raises InvalidValue for a scenario that takes more than MAX_BYTES, with the key that takes most of it."""
    num_people = len(scenario.people)
    robot, obstacles = scenario.estimation.robot.particles, scenario.estimation.obstacles.particles
    ticks = scenario.time_limit * scenario.control.rate
    parts: dict[str, tuple[float, object]] = {
        "time_limit": (
            ticks * (_TICK + _TICK_OF_PERSON * num_people),
            f"{scenario.time_limit:g} s: {ticks:.3g} ticks, {num_people} people",
        ),
        "estimation.robot.particles": (_PARTICLE * robot, robot),
        "estimation.obstacles.particles": (
            _PARTICLE * obstacles * num_people,
            f"{obstacles} for each of {num_people} people",
        ),
    }
    total = sum(size for size, _ in parts.values())
    if total > MAX_BYTES:
        key = max(parts, key=lambda part: parts[part][0])
        allowed = f"what takes at most {MAX_BYTES / 1e9:g} GB of memory in all; this takes {total / 1e9:.3g} GB"
        raise InvalidValue(key, parts[key][1], allowed)


# ------------------------------------------------------------------------------ a way for the robot


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
    from mjnav.geometry.floor import FreeSpace
    from mjnav.scenarios.ways import floor_of_robot

    points = [scenario.robot.start[:2], *scenario.robot.route]
    return FreeSpace.of(floor_of_robot(scenario.walls, scenario.tables, scenario.pillars), points)


# ----------------------------------------------------------------------- overlaps and people's ways


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
