"""Many seeds of scenes under controllers, as a table with intervals: the figures in README.md and the changelog.

    uv run python tests/benchmarks/seeds.py hall --seeds 50
    uv run python tests/benchmarks/seeds.py crossing1 --controller rkhs mean --seeds 50 --set control.degree=3
    uv run python tests/benchmarks/seeds.py hall crossing1 crossing3 --controller all --seeds 100 --table

Seeds are 0 ... n - 1 plus --first, the same for every controller. Rates carry Wilson 95 % intervals; the rest is
medians over the runs that succeeded (clearance: over all). Differences from the first controller are means over the
seeds on which both succeeded, with paired bootstrap 95 % intervals.
"""

import argparse
import json
import os
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from mjnav.control import names
from mjnav.loop.prepare import load_scenario
from mjnav.loop.run import run
from mjnav.metrics.intervals import paired_bootstrap, wilson
from mjnav.rng import stream

COMPARED = {"time_s": "time [s]", "control_cost": "control cost", "mean_deviation_m": "deviation [m]"}
KINDS = ("person", "table", "wall", "pillar")


def one(task: tuple[str, str, tuple[str, ...], int, bool]) -> dict:
    """The summary of one episode."""
    scene, controller, overrides, seed, log = task
    scenario = load_scenario(scene, overrides, controller=controller, seed=seed)
    with tempfile.TemporaryDirectory() as folder:
        return run(scenario, log=os.path.join(folder, "run.mcap") if log else None).summary


def rate(count: int, total: int) -> str:
    low, high = wilson(count, total)
    return f"{count:3d}/{total} {100 * count / total:5.1f} % [{100 * low:.1f}, {100 * high:.1f}]"


def median(rows: list[dict], *path: str) -> float:
    values = []
    for row in rows:
        value = row
        for key in path:
            value = value[key]
        if value is not None:
            values.append(value)
    return float(np.median(values)) if values else float("nan")


def describe(rows: list[dict]) -> str:
    """One controller's figures."""
    n = len(rows)
    good = [row for row in rows if row["success"]]
    clearances = [row["min_clearance_m"] for row in rows if row["min_clearance_m"] is not None]
    lines = [f"  success         {rate(len(good), n)}"]
    lines += [f"  hit {kind:11} {rate(sum(row['collisions'][kind] > 0 for row in rows), n)}" for kind in KINDS]
    lines.append(f"  timeouts        {rate(sum(row['outcome'] == 'timeout' for row in rows), n)}")
    lines.append(
        f"  time {median(good, 'time_s'):.2f} s, control cost {median(good, 'control_cost'):.2f}, mean deviation "
        f"{median(good, 'mean_deviation_m'):.3f} m, min clearance {median(rows, 'min_clearance_m'):.3f} m (5 % "
        f"{np.percentile(clearances, 5) if clearances else np.nan:.3f}), infeasible ticks "
        f"{100 * sum(r['infeasible_ticks'] for r in rows) / sum(r['ticks'] for r in rows):.1f} %"
    )
    lines.append(
        f"  RMSE robot {median(rows, 'localization_rmse_m'):.4f} m, people {median(rows, 'tracking_rmse_m'):.4f} m; "
        f"mean real-time factor {np.mean([row['real_time_factor'] for row in rows]):.1f}"
    )
    phases = rows[0]["compute_ms"]
    lines.append(
        "  ms p50/p99      "
        + ", ".join(
            f"{p} {median(rows, 'compute_ms', p, 'p50'):.2f}/{median(rows, 'compute_ms', p, 'p99'):.2f}" for p in phases
        )
    )
    return "\n".join(lines)


def differences(rows: list[dict], reference: list[dict]) -> list[str]:
    """Means of row - reference over common successes, with intervals, one for each of COMPARED."""
    pairs = [(a, b) for a, b in zip(rows, reference, strict=True) if a["success"] and b["success"]]
    found = []
    for key in COMPARED:
        a, b = (np.array([pair[side][key] for pair in pairs], float) for side in (0, 1))
        interval = paired_bootstrap(a, b, stream(0, "bootstrap", key))
        found.append("-" if interval is None else f"{(a - b).mean():+.2f} [{interval[0]:+.2f}, {interval[1]:+.2f}]")
    return [*found, str(len(pairs))]


def table_row(name: str, rows: list[dict], reference: list[dict]) -> str:
    """One controller's figures as a row of a Markdown table."""
    good = [row for row in rows if row["success"]]
    hit = sum(any(row["collisions"].values()) for row in rows)
    clearances = [row["min_clearance_m"] for row in rows if row["min_clearance_m"] is not None]
    cells = [
        f"`{name}`",
        rate(len(good), len(rows)).strip(),
        rate(hit, len(rows)).strip(),
        f"{np.median(clearances):.2f} ({np.percentile(clearances, 5):.2f})" if clearances else "-",
        *(f"{median(good, key):.2f}" for key in COMPARED),
        f"{100 * sum(r['infeasible_ticks'] for r in rows) / sum(r['ticks'] for r in rows):.1f} %",
        f"{median(rows, 'compute_ms', 'control', 'p50'):.2f} / {median(rows, 'compute_ms', 'control', 'p99'):.2f}",
        *differences(rows, reference),
    ]
    return f"| {' | '.join(cells)} |"


HEAD = ["controller", "success", "hit something", "clearance [m], 5 %", *COMPARED.values(), "infeasible ticks"]
HEAD += ["decision p50 / p99 [ms]", *(f"Δ {text}" for text in COMPARED.values()), "pairs"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--controller", nargs="+", default=["rkhs"])
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--set", action="append", default=[], dest="overrides")
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--log", action="store_true", help="write each run's log too, and delete it")
    form = parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="a row a run")
    form.add_argument("--table", action="store_true", help="a Markdown table a scene")
    arguments = parser.parse_args()
    if arguments.controller == ["all"]:
        arguments.controller = ["rkhs", *(name for name in names() if name != "rkhs")]
    with ProcessPoolExecutor(arguments.workers) as pool:
        for scene in arguments.scenes:
            reference: list[dict] = []
            if arguments.table:
                print(f"\n{scene}\n\n| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}", flush=True)
            for controller in arguments.controller:
                seeds = range(arguments.first, arguments.first + arguments.seeds)
                tasks = [(scene, controller, tuple(arguments.overrides), seed, arguments.log) for seed in seeds]
                rows = list(pool.map(one, tasks))
                reference = reference or rows
                if arguments.table:
                    print(table_row(controller, rows, reference), flush=True)
                elif arguments.json:
                    print("\n".join(json.dumps(row) for row in rows))
                else:
                    print(f"{scene}, {controller} {' '.join(arguments.overrides)}\n{describe(rows)}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
