"""Checks of a scenario before a run: keys without effect, memory, a way for the robot, overlapping bodies.

A key has no effect where another value replaces its value. Such keys are refused before a run. The scenario in a log
may have them, so that logs of earlier versions can be read.

The memory that a run takes is estimated before the run starts. The way of the robot leads between the bodies of the
scene to its goal.

For the check of overlaps a body is a disc or a rectangle seen from above. Walls and pillars may touch, cross and stand
in one another (corners, half columns), and bodies may touch. Every other overlap is refused, except that of two people
at the start: they step apart (`overlapping_people`). The robot fits under tables and meets their legs only; people, and
bodies as high as the table, meet its top.

An oracle (`is_avoidable`) tells whether any control of the robot avoids all contact in the first seconds of a scene.
People who start close ahead of a fast robot, or walk at one that stands, cannot be avoided by anybody: such a start
tests no method. The oracle knows all. It rolls out a robot that is at rest at the start, as in every run, under
controls that hold one speed and turn rate, then another, within the robot's limits of speed and acceleration; people
walk on as they would unseen (`foreseen`); walls, pillars and tables' legs stand. A start is avoidable where one of the
controls touches nothing.
"""

from bisect import bisect_left
from itertools import combinations, pairwise, product
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from mjnav.errors import InvalidValue
from mjnav.geometry.floor import TOUCH, FreeSpace
from mjnav.messages import Array
from mjnav.scene import bodies
from mjnav.scene.faults import check_kidnappings
from mjnav.scene.people import ConstantVelocity, Person, Replay, Row, StopAndGo, Walker
from mjnav.scene.published import check_case
from mjnav.scene.ranges import Point
from mjnav.scene.sensors import check_lidar
from mjnav.scene.spec import Control, Latency, Robot, Scenario
from mjnav.scene.ways import check_routes, check_trips, floor_of_robot

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
    robot, half_width = scenario.robot, scenario.robot.limits.half_width
    points = [robot.start[:2], *robot.route]
    met = bodies.met_by_robot(scenario.walls, scenario.tables, scenario.pillars)
    strips = [bodies.Strip(start, end, 0.0, half_width) for start, end in pairwise(points)]
    if not any(strip.meets(body) for strip in strips for body in met):
        return
    cut_off = _space(scenario).first_cut_off(points, half_width, tolerance=robot.goal_tolerance)
    if cut_off is not None:
        place = max(cut_off, 1) - 1
        allowed = f"a point to which a way leads from {points[0]}, {half_width:g} m clear of walls, legs and pillars"
        raise InvalidValue(robot.route_key(place), robot.route[place], allowed)


def robot_has_a_way(scenario: Scenario, room: float = 0.0) -> bool:
    """Whether the robot can go from its start through its waypoints to its goal with `room` [m] on each side.

    Each point of the route counts as reached within the goal's tolerance.
    """
    robot = scenario.robot
    points = [robot.start[:2], *robot.route]
    return _space(scenario).connects(points, robot.limits.half_width + room, tolerance=robot.goal_tolerance)


def _space(scenario: Scenario) -> FreeSpace:
    points = [scenario.robot.start[:2], *scenario.robot.route]
    return FreeSpace.of(floor_of_robot(scenario.walls, scenario.tables, scenario.pillars), points)


# ----------------------------------------------------------------------- overlaps and people's ways


def check(scenario: Scenario, *, routes: bool = True) -> None:
    """Raises InvalidValue for the first pair of bodies that overlap, and for a goal that cannot be reached.

    Without `routes`, only for the robot's goals, not for people's.
    """
    robot = scenario.robot
    if scenario.published is not None:
        check_case(scenario.published, scenario)
    check_lidar(scenario.sensors.scanner, robot.radius, scenario.physics.timestep)
    walls = [bodies.wall_box(f"walls.{i}", wall) for i, wall in enumerate(scenario.walls)]
    tops = [bodies.top_box(f"tables.{i}", table) for i, table in enumerate(scenario.tables)]
    legs = [leg for i, table in enumerate(scenario.tables) for leg in bodies.leg_discs(f"tables.{i}", table)]
    pillars = [bodies.pillar_disc(f"pillars.{i}", pillar) for i, pillar in enumerate(scenario.pillars)]
    people = [bodies.Disc(f"people.{i}", p.start, p.radius) for i, p in enumerate(scenario.people)]

    for i, (top, table) in enumerate(zip(tops, scenario.tables, strict=True)):
        for other in (*(wall for wall in walls if wall.height >= top.height), *tops[:i]):
            if top.overlaps(other):
                raise InvalidValue(f"{top.key}.position", table.position, f"a place clear of {other.key}")
        for leg in bodies.leg_discs(top.key, table):
            for wall in walls:
                _keep_apart(leg, wall, f"{top.key}.position", table.position)
    for pillar in pillars:
        for other in (*(top for top in tops if pillar.height >= top.height), *legs):
            _keep_apart(pillar, other, f"{pillar.key}.position", pillar.centre)
    around = bodies.met_by_people(scenario.walls, scenario.tables, scenario.pillars)
    for person in people:
        for other in around:
            _keep_apart(person, other, f"{person.key}.start", person.centre)
    if routes:
        check_routes(scenario)
    check_trips(scenario)
    (x, y, heading), limits = robot.start, robot.limits
    body = [
        bodies.Disc("robot", (x + ahead * cos(heading), y + ahead * sin(heading)), radius)
        for ahead, radius in limits.discs
    ]
    there = [disc for disc, person in zip(people, scenario.people, strict=True) if person.from_the_start]
    met = bodies.met_by_robot(scenario.walls, scenario.tables, scenario.pillars)
    for disc, other in product(body, (*met, *there)):
        _keep_apart(disc, other, "robot.start", robot.start)
    check_kidnappings(scenario.faults, robot.radius, met)
    for i, point in enumerate(robot.route):
        for other in met:
            room = other.distance(point)
            if room <= 0.0 or room + robot.goal_tolerance < limits.half_width:
                allowed = f"a point that the robot can reach to {robot.goal_tolerance:g} m, clear of {other.key}"
                raise InvalidValue(robot.route_key(i), point, allowed)


def overlapping_people(scenario: Scenario) -> list[tuple[int, int]]:
    """The pairs of people who overlap at the start, by their places in the scenario."""
    discs = [bodies.Disc("", person.start, person.radius) for person in scenario.people]
    there = [i for i, person in enumerate(scenario.people) if person.from_the_start]
    return [(i, j) for i, j in combinations(there, 2) if discs[i].radius - discs[j].distance(discs[i].centre) > TOUCH]


def _keep_apart(disc: bodies.Disc, other: bodies.Disc | bodies.Box, key: str, found: object) -> None:
    missing = disc.radius - other.distance(disc.centre)
    if missing > TOUCH:
        raise InvalidValue(key, found, f"a place clear of {other.key}, {missing:.3f} m further away")


# --------------------------------------------------------------------------- people's ways foreseen


MAX_ROUNDS = 100  # of a loop that are foreseen


def foreseen(person: Person, times: Array) -> Array:
    """Where the person is at each of `times` [s], ascending: (T, 2) [m]; NaN while they are not there.

    Straight walkers go at their velocity, walkers along straight legs, recorded people straight from row to row of
    their track; people of behaviours of one's own stand. Who leaves at the end of a way is gone: where they come again
    is not foreseen.
    """
    enters = person.enters or 0.0
    there = (times >= enters) & (times < (np.inf if person.leaves is None else person.leaves))
    since = np.maximum(times - enters, 0.0)
    match person.behaviour:
        case Replay(track=track):
            where = _on_track(track, times)
        case ConstantVelocity(velocity=velocity):
            where = person.start + since[:, None] * velocity
        case StopAndGo(velocity=velocity, go_time=go, stop_time=stop):
            walked = _walking(np.maximum(times, enters), go, stop) - _walking(np.array([enters]), go, stop)
            where = person.start + walked[:, None] * velocity
        case Walker() as walk:
            where, left = _on_legs(person.start, walk, walk.speed * since)
            within = walk.leaves_within
            there &= np.full(len(times), True) if within is None else left > within
        case _:
            where = np.tile(person.start, (len(times), 1))
    return np.where(there[:, None], where, np.nan)


def _on_track(track: tuple[Row, ...], times: Array) -> Array:
    """(T, 2) [m] at `times` (T,) [s]."""
    rows = np.array(track[: bisect_left(track, times[-1], key=lambda row: row[0]) + 1])
    return np.stack([np.interp(times, rows[:, 0], rows[:, k]) for k in (1, 2)], axis=1)


def _walking(times: Array, go: float, stop: float) -> Array:
    """For how long of [0, time] who walks and stands in turns has walked, (T,) [s]."""
    rounds, rest = np.divmod(times, go + stop)
    return go * rounds + np.minimum(rest, go)


def _on_legs(start: Point, walk: Walker, walked: Array) -> tuple[Array, Array]:
    """After `walked` [m] (T,): where a walker is, (T, 2), and how far it still is to the last point, (T,) [m]."""
    points = [start, *walk.waypoints]
    if walk.loop and len(walk.waypoints) > 1:
        around = sum(np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise([*walk.waypoints, walk.waypoints[0]]))
        rounds = int(walked[-1] / around) + 1 if around > 0.0 else 0
        points += walk.waypoints * min(rounds, MAX_ROUNDS)
    corners = np.array(points, float)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])  # [m] of each corner
    where = np.stack([np.interp(walked, along, corners[:, k]) for k in (0, 1)], axis=1)
    return where, along[-1] - walked


# --------------------------------------------------------------------------------------- the oracle


HORIZON = 3.0  # [s]
STEP = 0.05  # [s]; a person at 1.3 m/s moves 65 mm
SWITCH = 1.0  # [s] after which a control goes on to its second speed and turn rate
SPEEDS = (0.0, 0.5, 1.0)  # shares of the highest speed; of the lowest too where the robot may reverse
TURNS = (-1.0, -0.4, 0.0, 0.4, 1.0)  # shares of the highest turn rate


def is_avoidable(scenario: Scenario) -> bool:
    """Whether one of the sampled controls touches nothing within HORIZON."""
    robot, times = scenario.robot, STEP * np.arange(1, round(HORIZON / STEP) + 1, dtype=float)
    fastest = max(robot.max_speed, -robot.min_speed)
    near: list[tuple[Person, Array]] = []  # who can meet the robot, and where they are at `times`, (T, 2)
    standing = True  # whether a robot that stands touches nobody
    for person in scenario.people:
        walked = foreseen(person, times)
        gaps = np.hypot(walked[:, 0] - robot.start[0], walked[:, 1] - robot.start[1]) - person.radius - robot.radius
        if (gaps <= fastest * times).any():  # NaN for who is not there
            near.append((person, walked))
            standing &= not _touches(gaps[None], person).any()
    if standing:
        return True
    clear = _rollouts(robot, len(times))  # (K, T, 2) of which those stay that touch nothing
    for person, walked in near:
        gaps = np.hypot(*np.moveaxis(clear - walked, -1, 0)) - person.radius - robot.radius
        clear = clear[~_touches(gaps, person).any(axis=1)]
    floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
    return bool((floor.clearance(clear) >= robot.radius).all(axis=1).any()) if len(clear) else False


def _touches(gaps: Array, person: Person) -> NDArray[np.bool_]:
    """(K, T) where surfaces (K, T) [m] apart touch. A newcomer waits until the robot has left the place."""
    if person.from_the_start:
        return gaps < 0.0
    return (gaps < 0.0) & np.logical_or.accumulate(gaps >= 0.0, axis=1)


def _rollouts(robot: Robot, num: int) -> Array:
    """Positions of the robot under every control after each of `num` steps, (K, num, 2) [m]."""
    speeds = sorted({share * robot.max_speed for share in SPEEDS} | {robot.min_speed})
    turns = [share * robot.max_turn_rate for share in TURNS]
    wanted = np.array([(*one, *other) for one, other in product(product(speeds, turns), repeat=2)])  # (K, 4)
    x, y, heading = (np.full(len(wanted), value) for value in robot.start)
    v, omega = np.zeros(len(wanted)), np.zeros(len(wanted))
    out = np.empty((len(wanted), num, 2))
    for k in range(num):
        target = wanted[:, :2] if k * STEP < SWITCH else wanted[:, 2:]
        v = v + np.clip(target[:, 0] - v, -robot.max_acceleration * STEP, robot.max_acceleration * STEP)
        omega = omega + np.clip(
            target[:, 1] - omega, -robot.max_turn_acceleration * STEP, robot.max_turn_acceleration * STEP
        )
        heading = heading + omega * STEP
        x, y = x + v * np.cos(heading) * STEP, y + v * np.sin(heading) * STEP
        out[:, k, 0], out[:, k, 1] = x, y
    return out
