"""How much faster than real time a scene runs, against people, samples and particles; everything logged, headless.

    uv run python benchmarks/real_time_factor.py hall

Each point runs the same seed for --duration simulated seconds, back and forth between start and goal,
whatever it hits, and the best of --repeat runs counts: what else the machine does only ever slows a run down.
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from mjnav.loop.prepare import load_scenario
from mjnav.loop.realtime.stress import crowd, shuttling
from mjnav.loop.run import run
from mjnav.scene.spec import Scenario

PEOPLE = (1, 2, 5, 10, 20, 50, 100)
SAMPLES = (25, 50, 100, 200, 400)
PARTICLES = (100, 300, 1000, 3000, 10_000)


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
