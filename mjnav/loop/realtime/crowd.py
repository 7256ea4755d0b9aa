"""A scenario with another number of people, to see what they cost."""

from dataclasses import replace
from math import hypot

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.rng import stream
from mjnav.scenarios.check import check
from mjnav.scenarios.spec import Person, Scenario, Waypoints

MARGIN = 2.0  # [m] around everything on the map, where people may walk
MAX_TRIES = 1000  # places a person


def crowd(scenario: Scenario, num_people: int) -> Scenario:
    """The scenario with its first `num_people` people, and where it has fewer, with more who walk back and forth.

    They start and turn at random places, which follow the scenario's seed. Raises InvalidValue for a number below zero
    and where there is no room.
    """
    if num_people < 0:
        raise InvalidValue("people", num_people, "a number >= 0")
    people = scenario.people[:num_people]
    rng = stream(scenario.seed, "crowd")
    low, high = _bounds(scenario)
    while len(people) < num_people:
        for _ in range(MAX_TRIES):
            start, turn = rng.uniform(low, high, (2, 2)).round(3).tolist()
            walk = Waypoints((tuple(turn), tuple(start)), speed=float(rng.uniform(0.3, 0.8)))
            person = Person(tuple(start), walk)
            if any(hypot(start[0] - p.start[0], start[1] - p.start[1]) < p.radius + person.radius for p in people):
                continue
            try:
                check(replace(scenario, people=(person,)))
            except InvalidValue:
                continue
            people = (*people, person)
            break
        else:
            raise InvalidValue("people", num_people, f"at most {len(people)}: there is no room for more")
    return replace(scenario, people=people)


def _bounds(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and highest (x, y) where people may walk."""
    robot = scenario.robot
    points = [robot.start[:2], *robot.route, *(p.start for p in scenario.people)]
    points += [end for wall in scenario.walls for end in (wall.start, wall.end)]
    points += [body.position for body in (*scenario.tables, *scenario.pillars)]
    corners = np.array(points, float)
    margin = 0.0 if scenario.walls else MARGIN
    return corners.min(axis=0) - margin, corners.max(axis=0) + margin
