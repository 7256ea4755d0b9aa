"""Whether any control of the robot avoids all contact in the first seconds of a scene.

People who start close ahead of a fast robot, or walk at one that stands, cannot be avoided by anybody: such a start
tests no method. The oracle knows all. It rolls out a robot that is at rest at the start, as in every run, under
controls that hold one speed and turn rate, then another, within the robot's limits of speed and acceleration; people
walk on as they would unseen (`foreseen`); walls, pillars and tables' legs stand. A start is avoidable where one of the
controls touches nothing.
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import Array
from mjnav.scenarios.floor import floor_of_robot
from mjnav.scenarios.layout.foreseen import foreseen
from mjnav.scenarios.people import Person
from mjnav.scenarios.spec import Robot, Scenario

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
