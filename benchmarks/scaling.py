"""What a tick costs by people, samples, particles, candidates and beams, with exponents; everything logged, headless.

    uv run python benchmarks/scaling.py hall

Each point runs the same seed for --duration simulated seconds, back and forth between start and goal,
whatever it hits, and the best of --repeat runs counts: what else the machine does only ever slows a run down.
"""

import argparse
import sys
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np

from mjnav.control.problem.fan import num_rollouts
from mjnav.control.registry import shipped_parameters
from mjnav.errors import InvalidValue
from mjnav.loop.prepare import load_scenario
from mjnav.loop.realtime.stress import shuttling
from mjnav.loop.run import run
from mjnav.rng import stream
from mjnav.scene.check import check
from mjnav.scene.spec import Person, Scenario, Waypoints

PEOPLE = (1, 2, 5, 10, 20, 50, 100, 200)
SAMPLES = (25, 50, 100, 200, 400)
PARTICLES = (100, 300, 1000, 3000, 10_000, 100_000)
CANDIDATES = (10, 20, 40, 80)  # speeds, and turn rates: 100 to 6400 candidates
MOVES = ((2, 2), (2, 4), (3, 7), (5, 17), (10, 27))  # speeds and turn rates of a planner: 107 to 5693 rollouts
BEAMS = (90, 180, 360, 720, 1440, 2880)
PHASES = ("estimate", "control", "record", "tick")
MARGIN = 2.0  # [m] around everything on the map, where people may walk
MAX_TRIES = 1000  # places a person


def best(scenario: Scenario, duration: float, repeat: int) -> dict:
    """The summary of the fastest run."""
    scenario = shuttling(scenario, scenario.control.rate, duration)
    with tempfile.TemporaryDirectory() as folder:
        runs = [run(scenario, log=Path(folder) / f"{i}.mcap").summary for i in range(repeat)]
    return max(runs, key=lambda summary: summary["real_time_factor"])


def print_curve(what: str, points: Mapping[int, Scenario], arguments: argparse.Namespace) -> None:
    """One row a point, and the exponents of the times in the number: the slope of their logarithms, upper half."""
    print(f"\n{what:>10}  × real time" + "".join(f"{phase:>10}" for phase in PHASES) + "   p50 [ms]")
    rows = []
    for number, scenario in points.items():
        summary = best(scenario, arguments.duration, arguments.repeat)
        rows.append([summary["compute_ms"][phase]["p50"] for phase in PHASES])
        times = "".join(f"{time:10.2f}" for time in rows[-1])
        print(f"{number:>10}  {summary['real_time_factor']:11.1f}{times}", flush=True)
    upper = slice(len(rows) // 2, None)
    slopes = np.polyfit(np.log(list(points)[upper]), np.log(rows[upper]), 1)[0]
    print(f"{'exponent':>10}  {'':11}" + "".join(f"{slope:10.2f}" for slope in slopes), flush=True)


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


def crowds(scenario: Scenario) -> dict[int, Scenario]:
    """The scenario by number of people, as long as there is room for them."""
    points = {}
    with suppress(InvalidValue):
        for number in PEOPLE:
            points[number] = crowd(scenario, number)
    return points


def _bounds(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    """The lowest and highest (x, y) where people may walk."""
    robot = scenario.robot
    points = [robot.start[:2], *robot.route, *(p.start for p in scenario.people)]
    points += [end for wall in scenario.walls for end in (wall.start, wall.end)]
    points += [body.position for body in (*scenario.tables, *scenario.pillars)]
    corners = np.array(points, float)
    margin = 0.0 if scenario.walls else MARGIN
    return corners.min(axis=0) - margin, corners.max(axis=0) + margin


def candidates_of(scenario: Scenario) -> dict[int, tuple[str, ...]]:
    """Overrides by how many candidates, or rollouts, a method has with them; none for a method without such numbers."""
    parameters = shipped_parameters(scenario.control.method, scenario.control.period)
    if hasattr(parameters, "num_turn_rates"):
        nums = [num_rollouts(v, w, reverses=scenario.robot.limits.min_speed < 0.0) for v, w in MOVES]
        texts = [(f"control.num_speeds={v}", f"control.num_turn_rates={w}") for v, w in MOVES]
        return dict(zip(nums, texts, strict=True))
    if hasattr(parameters, "num_omega"):
        return {n * n: (f"control.num_v={n}", f"control.num_omega={n}") for n in CANDIDATES}
    return {}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--controller")
    parser.add_argument("--duration", type=float, default=10.0, help="simulated [s] a run")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--only", choices=("people", "samples", "particles", "candidates", "beams"))
    arguments = parser.parse_args()

    def changed(*overrides: str) -> Scenario:
        return load_scenario(arguments.scene, overrides, controller=arguments.controller)

    scenario = changed()
    control = scenario.control
    print(f"{arguments.scene}, {control.method}, {control.rate:g} Hz, everything logged")
    curves = {
        "people": lambda: crowds(scenario),
        "samples": lambda: {n: changed(f"control.samples={n}") for n in SAMPLES},
        "particles": lambda: {
            n: changed(f"estimation.robot.particles={n}", f"estimation.obstacles.particles={n}") for n in PARTICLES
        },
        "candidates": lambda: {n: changed(*overrides) for n, overrides in candidates_of(scenario).items()},
    }
    if "lidar" in (scenario.estimation.robot.source, scenario.estimation.obstacles.source):
        curves["beams"] = lambda: {n: changed(f"sensors.lidar.beams={n}") for n in BEAMS}
    for what, points in curves.items():
        if arguments.only in (None, what):
            print_curve(what, points(), arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main())
