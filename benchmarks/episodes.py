"""Episodes an hour of one core, and CPU time a simulated second and of an episode of one tick, of scenes of studies.

    uv run python benchmarks/episodes.py

Each row is a scene with its own engine and controller, --episodes seeds without a log. `loops` is the CPU time of a
simulated second over that of a loop of 10 000 small array operations, run before each episode: on a slower or a busier
machine both take longer, so it compares versions where times do not. The median of the episodes' ratios counts. An
episode of one tick shows what an episode costs beside its ticks, with the layout where that is drawn; its seeds are
others.
"""

import argparse
import sys
import time
from dataclasses import replace
from statistics import median

import numpy as np

from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import run, warm_up

ROWS = (
    ("hall", ()),
    ("rooms", ()),
    ("rooms", ("physics.engine=kinematic",)),
    ("crossing1", ("physics.engine=kinematic",)),
)
OPERATIONS = 10_000
OTHERS = 1000  # by which the seeds of short episodes are others


def reference() -> float:
    """The CPU time [s] of a loop of small array operations, of which a tick is made."""
    began, values = time.process_time(), np.linspace(0.0, 1.0, 48)
    for _ in range(OPERATIONS):
        values = np.cos(values)
    return time.process_time() - began


def main() -> int:
    """Measures and prints."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=4, help="a row")
    parser.add_argument("--controller", help="in place of the scenes' own")
    given = parser.parse_args()
    print(f"{'':30}  episodes/h   CPU ms a simulated s   loops a simulated s   CPU ms of one tick")
    for scene, overrides in ROWS:
        scenario = load_scenario(scene, overrides, controller=given.controller)
        warm_up(scenario)
        short, rows = replace(scenario, time_limit=scenario.control.period), []
        for seed in range(given.episodes):
            yardstick, began = reference(), time.process_time()
            simulated = run(scenario, seed=seed, warmed_up=True).summary["time_s"]
            ended = time.process_time()
            run(short, seed=seed + OTHERS, warmed_up=True)
            taken = ended - began
            rows.append((taken, taken / simulated, taken / simulated / yardstick, time.process_time() - ended))
        episode, second, loops, tick = (median(column) for column in zip(*rows, strict=True))
        name = f"{scene}, {scenario.physics.engine}, {scenario.control.method}"
        figures = f"{3600.0 / episode:10.0f}   {1e3 * second:20.1f}   {loops:19.2f}   {1e3 * tick:18.1f}"
        print(f"{name:30}  {figures}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
