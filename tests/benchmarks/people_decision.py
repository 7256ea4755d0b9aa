"""What one decision of all people costs, by behaviour and number of people: the budget is 0.3 ms for a hundred.

    uv run python tests/benchmarks/people_decision.py

People cross a hall of 8 m2 a person from side to side, around a wall and six tables in its middle, and see the robot.
Each row is the mean and the 99th percentile of --decisions decisions, routes and draws included, in CPU time.
"""

import argparse
import sys
import time
from collections.abc import Iterable

import numpy as np

from mjnav.messages import Array, WorldState
from mjnav.scenarios.check import check
from mjnav.scenarios.people.avoiding import Diagonal, Orca, SocialForce
from mjnav.scenarios.spec import Person, Robot, Scenario, Table, Wall, Waypoints
from mjnav.world.people.pedestrians import Pedestrians
from mjnav.world.people.walk import PERIOD

NUMBERS = (12, 25, 50, 100)
AREA = 8.0  # [m2] a person
NOISE = {"unsteadiness": 0.04, "diagonal": Diagonal(probability=0.001)}
BEHAVIOURS = {
    "waypoints": lambda goal: Waypoints((goal,), loop=False),
    "orca": lambda goal: Orca(waypoints=(goal,), loop=False),
    "social_force": lambda goal: SocialForce(waypoints=(goal,), loop=False),
    "helbing": lambda goal: SocialForce(waypoints=(goal,), loop=False, form="helbing"),
    "corridor": lambda goal: SocialForce(waypoints=(goal,), loop=False, form="moussaid", **NOISE),
}


def hall(behaviour: str, num_people: int) -> Scenario:
    """The scene; its half side is `h`."""
    h = 0.5 * float(np.sqrt(AREA * num_people))
    corners = [(-h, -h), (h, -h), (h, h), (-h, h)]
    walls = [Wall(a, b) for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)]
    middle = 0.5 * h
    walls.append(Wall((0.0, -middle), (0.0, middle)))
    tables = [Table((s * middle, y * middle), 0.5 * np.pi, (0.8, 0.6)) for s in (-1.0, 1.0) for y in (-1.0, 0.0, 1.0)]
    rng, people = np.random.default_rng(0), []
    scene = Scenario("bench", Robot((0.0, h + 2.0, 0.0), (1.0, h + 2.0)), walls=tuple(walls), tables=tuple(tables))
    while len(people) < num_people:
        (x, y), (to_x, to_y) = rng.uniform(0.4 - h, h - 0.4, (2, 2)).tolist()
        person = Person((x, y), BEHAVIOURS[behaviour]((-abs(to_x) if x > 0.0 else abs(to_x), to_y)), sees_robot=True)
        if _fits(scene, person) and all(np.hypot(*np.subtract(person.start, p.start)) > 0.65 for p in people):
            people.append(person)
    return Scenario("bench", scene.robot, walls=scene.walls, tables=scene.tables, people=tuple(people))


def _fits(scene: Scenario, person: Person) -> bool:
    try:
        check(Scenario("bench", scene.robot, walls=scene.walls, tables=scene.tables, people=(person,)))
    except ValueError:
        return False
    return True


def times(scenario: Scenario, decisions: int) -> Iterable[float]:
    """[us] of each decision after the first, which loads compiled code; people walk as they want to."""
    pedestrians = Pedestrians(scenario, 0)
    position = np.array([person.start for person in scenario.people])
    velocity: Array = np.zeros_like(position)
    for k in range(decisions + 1):
        world = WorldState(k * PERIOD, np.array(scenario.robot.start), np.zeros(2), position, velocity)
        begin = time.thread_time_ns()
        velocity = pedestrians.velocities(world)
        spent = time.thread_time_ns() - begin
        position = position + PERIOD * velocity
        if k > 0:
            yield 1e-3 * spent


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--decisions", type=int, default=500)
    decisions = parser.parse_args().decisions
    print(f"{'us, mean / p99':14s}" + "".join(f"{number:>15}" for number in NUMBERS))
    for behaviour in BEHAVIOURS:
        found = [list(times(hall(behaviour, number), decisions)) for number in NUMBERS]
        cells = [f"{np.mean(row):7.0f} /{np.quantile(row, 0.99):6.0f}" for row in found]
        print(f"{behaviour:14s}" + "".join(cells), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
