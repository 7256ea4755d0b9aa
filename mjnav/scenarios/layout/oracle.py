"""Whether any control of the robot avoids all contact in the first seconds of a scene.

People who start close ahead of a fast robot, or walk at one that stands, cannot be avoided by anybody: such a start
tests no method. The oracle knows all. It rolls out a robot that is at rest at the start, as in every run, under
controls that hold one speed and turn rate, then another, within the robot's limits of speed and acceleration; people
walk on as they would unseen, at the velocity with which they start; walls, pillars and tables' legs stand. A start is
avoidable where one of the controls touches nothing.
"""

from itertools import product

import numpy as np

from mjnav.messages import Array
from mjnav.scenarios.floor import floor_of_robot
from mjnav.scenarios.people import Person
from mjnav.scenarios.spec import Robot, Scenario

HORIZON = 3.0  # [s]
STEP = 0.05  # [s]; a person at 1.3 m/s moves 65 mm
SWITCH = 1.0  # [s] after which a control goes on to its second speed and turn rate
SPEEDS = (0.0, 0.5, 1.0)  # shares of the highest speed; of the lowest too where the robot may reverse
TURNS = (-1.0, -0.4, 0.0, 0.4, 1.0)  # shares of the highest turn rate


def is_avoidable(scenario: Scenario) -> bool:
    """Whether one of the sampled controls touches nothing within HORIZON."""
    people = [person for person in scenario.people if _counts(person, scenario.robot)]
    if not people:
        return True
    times = STEP * np.arange(1, round(HORIZON / STEP) + 1)
    start = np.array([person.start for person in people])
    velocity = np.array([start_velocity(person) for person in people])
    radius = np.array([person.radius for person in people]) + scenario.robot.radius
    walked = start + times[:, None, None] * velocity  # (T, P, 2)
    still = np.hypot(*np.moveaxis(walked - scenario.robot.start[:2], -1, 0))
    if (still >= radius).all():
        return True
    driven = _rollouts(scenario.robot, len(times))  # (K, T, 2)
    apart = np.hypot(*np.moveaxis(driven[:, :, None] - walked, -1, 0))
    clear = driven[(apart >= radius).all(axis=(1, 2))]
    floor = floor_of_robot(scenario.walls, scenario.tables, scenario.pillars)
    return bool((floor.clearance(clear) >= scenario.robot.radius).all(axis=1).any()) if len(clear) else False


def start_velocity(person: Person) -> tuple[float, float]:
    """With which a person starts who sees nobody, [m/s]: that of their behaviour, or towards their first waypoint."""
    walk = person.behaviour
    velocity, waypoints = getattr(walk, "velocity", None), getattr(walk, "waypoints", ())
    if velocity is not None and not callable(velocity):
        return float(velocity[0]), float(velocity[1])
    for x, y in waypoints:
        dx, dy = x - person.start[0], y - person.start[1]
        length = float(np.hypot(dx, dy))
        if length > 0.0:
            speed = float(getattr(walk, "speed", 0.0))
            return speed * dx / length, speed * dy / length
    return 0.0, 0.0


def _counts(person: Person, robot: Robot) -> bool:
    """Whether the person can come near to the robot within HORIZON."""
    reach = HORIZON * (np.hypot(*start_velocity(person)) + max(robot.max_speed, -robot.min_speed))
    apart = np.hypot(person.start[0] - robot.start[0], person.start[1] - robot.start[1])
    return bool(apart <= reach + person.radius + robot.radius)


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
