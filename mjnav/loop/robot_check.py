"""What a robot does with its commands in MuJoCo: straight on, a spin, a figure of eight, and a stop from full speed.

Each drives on an empty floor without noise, from rest, and compares the true motion with what was commanded.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, pi

import numpy as np

from mjnav.loop.simulation import Simulation
from mjnav.messages import Array
from mjnav.scene.spec import Scenario

SETTLES = 1.0  # [s] besides the ramp, after which a speed is taken to be reached
ROLLS, SKIDS = 0.05, 0.25  # share of an eight's length by which it may miss its start: skids differ with the speed
MEASURED = 3.0  # [s] over which it is measured


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure of a check, and between what it has to be."""

    manoeuvre: str
    name: str
    value: float
    unit: str
    low: float
    high: float

    @property
    def holds(self) -> bool:
        """Whether it is within its bounds."""
        return self.low <= self.value <= self.high


@dataclass(frozen=True, slots=True)
class Driven:
    """A drive: poses at the ticks, of the truth and of the odometry, and the period [s]."""

    poses: Array  # (T + 1, 3), the heading counted on
    odometry: Array  # (3,) at the end
    period: float

    @property
    def speed(self) -> Array:
        """Along the heading, (T,) [m/s]: the mean of each period."""
        moved, heading = np.diff(self.poses[:, :2], axis=0), self.poses[:-1, 2] + 0.5 * np.diff(self.poses[:, 2])
        return (moved[:, 0] * np.cos(heading) + moved[:, 1] * np.sin(heading)) / self.period

    @property
    def turn_rate(self) -> Array:
        """(T,) [rad/s]"""
        return np.diff(self.poses[:, 2]) / self.period


def driven(scenario: Scenario, commands: list[tuple[float, float]]) -> Driven:
    """Under one command a tick."""
    poses, odometry = [], np.zeros(3)
    with Simulation(scenario, log=False, estimators=False, scan=False) as simulation:
        for v, omega in commands:
            poses.append(simulation.truth.robot_pose)
            simulation.step(v, omega)
        poses.append(simulation.truth.robot_pose)
        odometry = simulation.readings[-1].odometry_pose
    found = np.array(poses)
    found[:, 2] = np.unwrap(found[:, 2])
    return Driven(found, odometry, scenario.control.period)


def checked(scenario: Scenario) -> Iterator[Figure]:
    """The figures of a scenario's robot, on a floor of its own without noise."""
    robot, period = scenario.robot, scenario.control.period
    speed, turn = robot.max_speed, robot.max_turn_rate

    def ticks(duration: float) -> int:
        return ceil(duration / period)

    def rise(manoeuvre: str, what: str, found: Array, share: float, end: float, ramp: float) -> Figure:
        """When a motion (T,) reaches a share of its `end`, all of which an ideal `ramp` reaches [s]."""
        reached = (int(np.argmax(found >= share * end)) + 1) * period
        most = share * ramp + 3.0 * period + 0.2
        return Figure(manoeuvre, f"until {100.0 * share:.0f} % of the {what}", reached, "s", 0.0, most)

    settles = ticks(speed / robot.max_acceleration + SETTLES)
    stops = ticks(2.0 * speed / robot.max_acceleration + SETTLES)
    run = driven(scenario, [(speed, 0.0)] * (settles + ticks(MEASURED)) + [(0.0, 0.0)] * stops)
    at_speed = settles + ticks(MEASURED)
    straight, length = float(run.speed[settles:at_speed].mean()), float(run.poses[at_speed, 0])
    ideal = speed**2 / (2.0 * robot.max_acceleration) + speed * period
    yield Figure("straight", "speed, of the commanded", straight / speed, "", 0.97, 1.03)
    yield Figure("straight", "aside after 1 m", abs(float(run.poses[at_speed, 1])) / length, "m", 0.0, 0.02)
    yield rise("straight", "speed", run.speed, 0.95, straight, speed / robot.max_acceleration)
    stopped = float(run.poses[-1, 0] - run.poses[at_speed, 0])
    yield Figure("stop", "way from full speed", stopped, "m", 0.0, 1.2 * ideal + 0.05)
    yield Figure("stop", "speed at the end", abs(float(run.speed[-1])), "m/s", 0.0, 0.02)

    settles = ticks(turn / robot.max_turn_acceleration + SETTLES)
    run = driven(scenario, [(0.0, turn)] * (settles + ticks(MEASURED)))
    rate = float(run.turn_rate[settles:].mean())
    yield Figure("spin", "turn rate, of the commanded", rate / turn, "", 0.95, 1.05)
    yield rise("spin", "turn rate", run.turn_rate, 0.9, rate, turn / robot.max_turn_acceleration)
    away = np.hypot(*(run.poses[:, :2] - run.poses[0, :2]).T)
    yield Figure("spin", "away from its place", float(away.max()), "m", 0.0, 0.5 * robot.radius)
    if robot.base is not None:
        factor = robot.base.turn_factor * turn / rate
        bounds = (0.95 * robot.base.turn_factor, 1.05 * robot.base.turn_factor)
        yield Figure("spin", "turn_factor that it asks for", factor, "", *bounds)

    most = ROLLS if robot.base is None or robot.base.turn_factor == 1.0 else SKIDS
    v, omega = 0.5 * speed, 0.5 * min(turn, speed / robot.radius)
    loop = round(2.0 * pi / omega / period)
    run = driven(scenario, [(v, omega)] * loop + [(v, -omega)] * loop)
    way = 2.0 * loop * period * v
    apart, by_wheels = run.poses[-1, :2] - run.poses[0, :2], run.odometry[:2] - run.poses[-1, :2] + run.poses[0, :2]
    yield Figure("eight", "end from start, of its length", float(np.hypot(*apart)) / way, "", 0.0, most)
    yield Figure("eight", "odometry off at its end, of its length", float(np.hypot(*by_wheels)) / way, "", 0.0, most)
