"""Load and scenarios of real-time tests: busy processes, and a route driven back and forth.

The load is a process for every CPU that computes, and one that writes to the disk. Each ends when the context closes,
or when its parent has died.

A rate test drives a scene back and forth for a given time, at a given control rate.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import pairwise
from math import ceil, hypot

from mjnav.errors import InvalidValue
from mjnav.scene.ranges import MAX_POINTS, MAX_RATE, MAX_TIME, MIN_RATE
from mjnav.scene.spec import Scenario
from mjnav.settings import Range

# --------------------------------------------------------------------------------------------- load


_COMPUTE = """
import os, sys
while os.getppid() == int(sys.argv[1]):
    sum(i * i for i in range(200_000))
"""
_WRITE = """
import os, sys
block = os.urandom(1 << 20)
with open(sys.argv[2], "wb") as file:
    while os.getppid() == int(sys.argv[1]):
        file.seek(0)
        for _ in range(16):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
"""


@contextmanager
def stress() -> Iterator[str]:
    """Runs the load; yields what it is, in words."""
    num_cpus, parent = len(os.sched_getaffinity(0)), str(os.getpid())
    with tempfile.NamedTemporaryFile(prefix="mjnav-stress-") as file:
        programs = [(_COMPUTE, parent)] * num_cpus + [(_WRITE, parent, file.name)]
        processes: list[subprocess.Popen] = []
        try:
            for program in programs:  # in sessions of their own: an interrupt at the terminal is not theirs to answer
                processes.append(subprocess.Popen([sys.executable, "-P", "-c", *program], start_new_session=True))
            yield f"{num_cpus} computing processes and one that writes and syncs 16 MiB over and over"
        finally:
            for process in processes:
                process.kill()
            for process in processes:
                process.wait()


# ----------------------------------------------------------------------------- route back and forth


TIMESTEP = 0.002  # [s], the longest
MAX_REFINEMENT = 100  # of the timestep, until the sensors' period is a whole number of steps too
MIN_LEG = 0.2  # [m] that a leg of the route is longer than the tolerances at its ends


def shuttling(scenario: Scenario, rate: float, duration: float) -> Scenario:
    """The scenario at `rate` [Hz], back and forth between start and goal for `duration` [s], whatever it hits.

    The time step is the longest up to 2 ms that divides the period and the sensors'. Raises InvalidValue.
    """
    Range(MIN_RATE, MAX_RATE, "Hz").check("rate", rate)
    Range(0.0, MAX_TIME, "s", open_low=True).check("duration", duration)
    robot = scenario.robot
    there = [robot.start[:2], *robot.route]
    round_trip = [*there[1:], *there[-2::-1]]
    longest = max(hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(there))
    leg = longest - 2.0 * robot.goal_tolerance
    if leg < MIN_LEG:
        far = 2.0 * robot.goal_tolerance + MIN_LEG
        raise InvalidValue(
            "robot.goal" if robot.goal is not None else "robot.waypoints",
            robot.route[-1],
            f"a way to drive: {far:g} m, twice robot.goal_tolerance and {MIN_LEG:g} m",
            file=scenario.source or None,
        )
    num_trips = 2 * ceil(duration * robot.max_speed / (2.0 * leg)) + 1  # twice: beliefs reach a point before the robot
    if len(round_trip) * num_trips > MAX_POINTS:
        most = (MAX_POINTS // len(round_trip) - 1) // 2 * 2.0 * leg / robot.max_speed
        raise InvalidValue(
            "duration", duration, f"at most {most:.0f} s on so short a way: {MAX_POINTS} points of a route"
        )
    return replace(
        scenario,
        robot=replace(robot, goal=None, waypoints=tuple(round_trip * num_trips)),
        time_limit=duration,
        stop_on_collision=False,
        control=replace(scenario.control, rate=rate),
        physics=replace(scenario.physics, timestep=_timestep(rate, scenario.sensors.rate)),
    )


def _timestep(rate: float, sensor_rate: float) -> float:
    least = ceil(1.0 / (rate * TIMESTEP) - 1e-9)
    for steps in range(least, MAX_REFINEMENT * least + 1):
        sensor_steps = steps * rate / sensor_rate
        if abs(sensor_steps - round(sensor_steps)) < 1e-9 * sensor_steps and round(sensor_steps) >= 1:
            return 1.0 / (rate * steps)
    raise InvalidValue("rate", rate, f"a rate with a time step in common with sensors.rate ({sensor_rate:g} Hz)")
