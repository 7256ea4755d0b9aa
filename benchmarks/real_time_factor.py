"""How much faster than real time a scene runs, against people, samples and particles; everything logged, headless.

    uv run python benchmarks/real_time_factor.py hall

Each point runs the same seed for --duration simulated seconds, back and forth between start and goal,
whatever it hits, and the best of --repeat runs counts: what else the machine does only ever slows a run down.
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np

from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.loop.realtime.stress import shuttling
from mjnav.loop.run import run
from mjnav.rng import stream
from mjnav.scene.check import check
from mjnav.scene.spec import Person, Scenario, Waypoints

PEOPLE = (1, 2, 5, 10, 20, 50, 100)
SAMPLES = (25, 50, 100, 200, 400)
PARTICLES = (100, 300, 1000, 3000, 10_000)
MARGIN = 2.0  # [m] around everything on the map, where people may walk
MAX_TRIES = 1000  # places a person


def best(scenario: Scenario, duration: float, repeat: int) -> dict:
    """The summary of the fastest run."""
    scenario = shuttling(scenario, scenario.control.rate, duration)
    with tempfile.TemporaryDirectory() as folder:
        runs = [run(scenario, log=Path(folder) / f"{i}.mcap").summary for i in range(repeat)]
    return max(runs, key=lambda summary: summary["real_time_factor"])


def print_curve(what: str, points: dict[int, Scenario], arguments: argparse.Namespace) -> None:
    """One row a point."""
    print(f"\n{what:>10}  × real time   tick p50   p99 [ms]   estimate   control   record")
    for number, scenario in points.items():
        summary = best(scenario, arguments.duration, arguments.repeat)
        ms = summary["compute_ms"]
        phases = "   ".join(f"{ms[phase]['p50']:7.2f}" for phase in ("estimate", "control", "record"))
        tick = f"{ms['tick']['p50']:8.2f}   {ms['tick']['p99']:8.2f}"
        print(f"{number:>10}  {summary['real_time_factor']:11.1f}   {tick}    {phases}", flush=True)


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


def with_particles(scenario: Scenario, number: int) -> Scenario:
    """The scenario with `number` particles for the robot and for each person."""
    estimation = scenario.estimation
    robot, obstacles = (replace(part, particles=number) for part in (estimation.robot, estimation.obstacles))
    return replace(scenario, estimation=replace(estimation, robot=robot, obstacles=obstacles))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--controller")
    parser.add_argument("--duration", type=float, default=10.0, help="simulated [s] a run")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    scenario = load_scenario(arguments.scene, controller=arguments.controller)
    control = scenario.control
    samples = {n: replace(control, parameters={**control.parameters, "samples": n}) for n in SAMPLES}
    print(f"{arguments.scene}, {control.method}, {control.rate:g} Hz, everything logged")
    print_curve("people", {n: crowd(scenario, n) for n in PEOPLE}, arguments)
    print_curve("samples", {n: replace(scenario, control=changed) for n, changed in samples.items()}, arguments)
    print_curve("particles", {n: with_particles(scenario, n) for n in PARTICLES}, arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main())
