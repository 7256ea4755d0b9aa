"""Steps a second of `mjnav.Simulation` beside those of a run, and what a branch costs; ratios of one process.

    uv run python benchmarks/stepping.py hall

Each loop drives the same scenario and seed for --duration simulated seconds, whatever it hits; rounds of all loops take
turns, and the best of each counts.
"""

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from statistics import median
from time import perf_counter

from mjnav.loop.episode import Episode
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import warm_up
from mjnav.loop.simulation import Simulation
from mjnav.scene.spec import Scenario

BRANCHES = 30
WARM_STEPS = 10  # before a branch is timed


def run(scenario: Scenario) -> int:
    """The loop of `mjnav run`."""
    return Episode(scenario).run().summary["ticks"]


def decided(scenario: Scenario) -> int:
    """By hand, on the controller's decisions."""
    simulation = Simulation(scenario)
    while not simulation.done:
        simulation.step(simulation.decide())
    return simulation.tick


def commanded(scenario: Scenario, **options: bool) -> int:
    """By hand, on commands of one's own."""
    simulation = Simulation(scenario, **options)
    while not simulation.done:
        simulation.step(0.3, 0.1)
    return simulation.tick


LOOPS: dict[str, Callable[[Scenario], int]] = {
    "mjnav run": run,
    "step(decide())": decided,
    "step(v, omega)": commanded,
    "without estimators": lambda scenario: commanded(scenario, estimators=False),
    "without, with a scan": lambda scenario: commanded(scenario, estimators=False, scan=True),
}


def branch_times(simulation: Simulation) -> tuple[float, float]:
    """Medians of what `copy` and `restore` take in the middle of a drive [s]."""
    for _ in range(WARM_STEPS):
        simulation.step(0.3, 0.0)
    branch = simulation.copy()
    copied = median(timed(simulation.copy) for _ in range(BRANCHES))
    return copied, median(timed(lambda: branch.restore(simulation)) for _ in range(BRANCHES))


def timed(call: Callable[[], object]) -> float:
    """[s]"""
    began = perf_counter()
    call()
    return perf_counter() - began


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--set", action="append", default=[], dest="overrides")
    parser.add_argument("--duration", type=float, default=10.0, help="simulated [s] of a round")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    scenario = load_scenario(arguments.scene, [*arguments.overrides, f"time_limit={arguments.duration:g}"])
    scenario = replace(scenario, stop_on_collision=False)
    warm_up(scenario)
    rates = dict.fromkeys(LOOPS, 0.0)
    for _ in range(arguments.repeat):
        for name, loop in LOOPS.items():
            began = perf_counter()
            ticks = loop(scenario)
            rates[name] = max(rates[name], ticks / (perf_counter() - began))
    print(f"{arguments.scene}, {scenario.physics.engine}, {scenario.control.method}")
    print(f"{'loop':22s}{'steps/s':>9s}{'x run':>8s}")
    for name, rate in rates.items():
        print(f"{name:22s}{rate:9.0f}{rate / rates['mjnav run']:8.2f}")

    print(f"\n{'branch':22s}{'copy ms':>9s}{'restore ms':>12s}")
    for name, estimators in (("with estimators", True), ("without", False)):
        copied, restored = branch_times(Simulation(scenario, estimators=estimators))
        print(f"{name:22s}{1e3 * copied:9.2f}{1e3 * restored:12.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
