"""What a sweep costs beside its episodes, and what a second worker brings.

    uv run python benchmarks/sweep_efficiency.py --episodes 200

The same episodes of kinematic `crossing1` on one worker and on two. `whole` is the sweep's time with the start of its
workers and all shards, `steady` that from each worker's first row on. Efficiency is the time on one worker over twice
that on two. What a sweep spends beside an episode is workers x steady time - the episodes' own, for each of them; the
episodes' own time is shown for one and for two at work, for processors that share caches slow one another down.
"""

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from mjnav.study.cells import resolve
from mjnav.study.store import Row, Store
from mjnav.study.study_file import load_study
from mjnav.study.sweep.schedulers import Scheduler, local
from mjnav.study.sweep.sweep import sweep, trials
from mjnav.study.trial import Trial, run_trial

STUDY = """
schema = 1
name = "efficiency"
scenes = ["crossing1"]
seeds = { count = %d }
set = { physics.engine = "kinematic" }
[[methods]]
controller = "rkhs"
"""


@dataclass
class Clock:
    """When each row came, and what its episode took."""

    times: list[float] = field(default_factory=list)
    own: list[float] = field(default_factory=list)

    def __call__(self, done: int, row: Row) -> None:
        self.times.append(time.monotonic())
        self.own.append(row.wall_s)


def measure(name: str, wanted: list[Trial], scheduler: Scheduler, workers: int) -> tuple[float, float]:
    """Whole and steady time [s]."""
    clock = Clock()
    with tempfile.TemporaryDirectory() as folder:
        whole = sweep(wanted, Store(folder), scheduler, progress=clock).seconds
    steady = clock.times[-1] - clock.times[workers - 1]
    num = len(wanted) - workers
    own = sum(clock.own[workers:]) / num
    beside = 1e3 * (workers * steady / num - own)
    print(
        f"{name:12} whole {whole:6.1f} s, steady {steady:6.1f} s; an episode {own:.3f} s, beside it {beside:5.1f} ms",
        flush=True,
    )
    return whole, steady


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=200)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "efficiency.toml"
        path.write_text(STUDY % arguments.episodes)
        study = load_study(path)
        wanted = trials(study, resolve(study))
    measure("this process", wanted, lambda trials: (row for row in map(run_trial, trials)), 1)
    one = measure("1 worker", wanted, local(1), 1)
    two = measure("2 workers", wanted, local(2), 2)
    whole, steady = (100.0 * a / (2.0 * b) for a, b in zip(one, two, strict=True))
    print(f"efficiency on 2 workers: {whole:.0f} % whole, {steady:.0f} % steady")
    return 0


if __name__ == "__main__":
    sys.exit(main())
