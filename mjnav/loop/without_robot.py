"""The people of a scene without the robot: the same engine, behaviours and random streams."""

from dataclasses import replace

import numpy as np

from mjnav.errors import MjnavError
from mjnav.loop.result import Result
from mjnav.messages import Array
from mjnav.metrics.detour import detour
from mjnav.plugins import BehaviourPlugin
from mjnav.scenarios.ranges import MAX_LENGTH
from mjnav.scenarios.spec import Person, Scenario
from mjnav.world.simulator import Simulator

FAR = (-MAX_LENGTH, -MAX_LENGTH, 0.0)  # where the robot stands, at the end of all coordinates


def people_without_robot(scenario: Scenario, seed: int, ticks: int) -> Array:
    """Where the people are at the times of the ticks, (ticks + 1, P, 2) [m], if there is no robot.

    The robot stands where nobody meets it, and nobody sees it; for behaviours of a user's own, which may rely on
    knowing where it is, it is far away. Raises what a behaviour raises, and DivergedError.
    """
    alone = replace(
        scenario,
        robot=replace(scenario.robot, start=FAR),
        people=tuple(_unseeing(person) for person in scenario.people),
    )
    world = Simulator(alone, seed, lidar=False)
    places: list[Array] = [world.state().people_position]
    for _ in range(ticks):
        world.advance(scenario.control.period, (0.0, 0.0))
        places.append(world.state().people_position)
    return np.array(places)


def with_detour(result: Result, scenario: Scenario) -> Result:
    """The result of a run with what the robot cost the people; a fault where they cannot be run without it."""
    if not scenario.people:
        return result
    try:
        alone = people_without_robot(scenario, scenario.seed, len(result.trajectory.status))
    except MjnavError as error:
        faults = (*result.metrics.faults, f"detour: the people without the robot: {error}")
        return replace(result, metrics=replace(result.metrics, faults=faults))
    return replace(result, run=replace(result.run, detour=detour(result.trajectory, alone, scenario)))


def _unseeing(person: Person) -> Person:
    return person if isinstance(person.behaviour, BehaviourPlugin) else replace(person, sees_robot=False)
