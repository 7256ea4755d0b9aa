"""What `mjnav compare` takes for a great many rows.

    uv run python benchmarks/compare_rows.py --rows 100000

Makes up the results of a study, some of whose runs collide, time out or fail, and times the command on them in a
process of its own, from its start to its end: printed, and with a file of every kind.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from mjnav.study.store import FIGURES, NUMBER, Row, Store, Value

SCENES, SETTINGS, METHODS = 5, 10, 10
SHARD_ROWS = 5_000
FAILING = 0.001  # of all episodes
FILES = ("table.csv", "table.tex", "table.html")


def made_up(scene: int, setting: int, method: int, seed: int, rng: np.random.Generator) -> Row:
    """A row with the figures of an episode that was never run."""
    label = f"{scene} {setting} {method} {seed}"
    row = Row(
        id=f"{hash(label) & (2**64 - 1):032x}",
        study="made up",
        scene=f"scene{scene}",
        setting=f"noise={setting}",
        method=f"method{method}",
        seed=seed,
        controller="mean",
        parameters="{}",
        control="{}",
        scenario=f"scene {scene}, setting {setting}, method {method}\n" + 60 * "key = 1.0  # as long as one\n",
        machine="here",
        revision="none",
        wall_s=1.0,
        made_with={},
        figures={},
    )
    if rng.random() < FAILING:
        return replace(row, error="ZeroDivisionError: made up")
    outcome = rng.choice(["goal", "collision", "timeout"], p=[0.9, 0.08, 0.02])
    numbers = [name for name, column in FIGURES.items() if column.type == NUMBER]
    figures: dict[str, Value] = dict(zip(numbers, rng.lognormal(method / METHODS, 0.3, len(numbers)), strict=True))
    figures |= {f"collisions_{kind}": 0 for kind in ("table", "wall", "pillar")}
    figures |= {"collisions_person": int(outcome == "collision"), "outcome": str(outcome), "success": outcome == "goal"}
    figures |= {"ticks": 300, "infeasible_ticks": int(rng.integers(20)), "state_hash": label}
    return replace(row, figures=figures)


def fill(store: Store, num_rows: int) -> None:
    """Seed by seed, as a sweep does it."""
    rng = np.random.default_rng(0)
    cells = [(a, b, c) for a in range(SCENES) for b in range(SETTINGS) for c in range(METHODS)]
    with store.writing(""):
        rows: list[Row] = []
        for number in range(num_rows):
            rows.append(made_up(*cells[number % len(cells)], number // len(cells), rng))
            if len(rows) == SHARD_ROWS or number == num_rows - 1:
                store.append(rows)
                rows = []


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", type=int, default=100_000)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        store = Store(Path(folder) / "results")
        fill(store, arguments.rows)
        files = [word for name in FILES for word in ("-o", str(Path(folder) / name))]
        for more in ([], files):
            began = time.perf_counter()
            command = [sys.executable, "-m", "mjnav.cli.main", "compare", str(store.folder), *more]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            took = time.perf_counter() - began
            memory = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
            kind = "with files" if more else "printed"
            print(
                f"{arguments.rows} rows in {SCENES * SETTINGS * METHODS} cells, {kind}: {took:.1f} s, {memory:.0f} MB"
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
