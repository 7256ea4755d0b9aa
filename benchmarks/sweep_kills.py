"""Kills workers, drivers and schedulers of sweeps until these are done, and compares what they kept with serial runs.

    uv run python benchmarks/sweep_kills.py --episodes 200 --kills 5

Every process is a real one and every kill is SIGKILL at a random moment. A row a case: sweeps that it took, rows,
distinct ids, episodes lost, episodes whose state hash is not the serial one.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from mjnav.study.cells import resolve
from mjnav.study.store import Store
from mjnav.study.study_file import load_study
from mjnav.study.sweep.sweep import trials
from mjnav.study.trial import run_trial

STUDY = """
schema = 1
name = "kills"
scenes = ["crossing1", "crossing3"]
seeds = { count = %d }
set = { physics.engine = "kinematic", time_limit = 5.0 }
[[methods]]
controller = "rkhs"
[[methods]]
controller = "mean"
"""


def sweep(study: Path, out: Path, *where: str) -> subprocess.Popen:
    command = [sys.executable, "-m", "mjnav.cli.main", "sweep", str(study), "-o", str(out), "--resume", *where]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def descendants(pid: int) -> list[int]:
    children = [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    return [*children, *(further for child in children for further in descendants(child))]


def workers_of(driver: subprocess.Popen) -> list[int]:
    try:
        pids = descendants(driver.pid)
        return [pid for pid in pids if "spawn_main" in Path(f"/proc/{pid}/cmdline").read_text()]
    except OSError:
        return []


def kill_workers(study: Path, out: Path, kills: int) -> tuple[int, int]:
    """One sweep, some of whose workers are killed. As of every case, the kills and sweeps that there were."""
    done = 0
    driver = sweep(study, out, "--workers", "2")
    while driver.poll() is None:
        time.sleep(random.uniform(0.5, 2.0))
        workers = workers_of(driver)
        if done < kills and workers and Store(out).has_rows():
            with suppress(ProcessLookupError):
                os.kill(random.choice(workers), signal.SIGKILL)
                done += 1
    return done, 1


def kill_drivers(study: Path, out: Path, kills: int) -> tuple[int, int]:
    """A sweep that is killed some time after each start, then one that is not."""
    done = 0
    for _ in range(kills):
        driver = sweep(study, out, "--workers", "2")
        shards = num_shards(out)
        while driver.poll() is None and num_shards(out) == shards:
            time.sleep(0.05)
        time.sleep(random.uniform(0.0, 1.0))
        done += driver.poll() is None
        driver.kill()
        driver.wait()
    sweep(study, out, "--workers", "2").wait()
    return done, kills + 1


def num_shards(out: Path) -> int:
    return len(list(out.glob("*.parquet")))


@contextmanager
def dask(folder: Path) -> Iterator[tuple[str, subprocess.Popen, Callable[[], subprocess.Popen]]]:
    """A scheduler's address and process, and what starts a worker."""
    where = folder / f"scheduler-{random.random()}.json"
    started: list[subprocess.Popen] = []

    def start(program: str, *options: str) -> subprocess.Popen:
        command = [sys.executable, "-m", f"distributed.cli.{program}", "--host", "127.0.0.1", "--no-dashboard"]
        command += ["--scheduler-file", str(where), *options]
        started.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=folder))
        return started[-1]

    try:
        scheduler = start("dask_scheduler", "--port", "0")
        while not where.exists():
            time.sleep(0.1)
        address = json.loads(where.read_text())["address"]
        yield address, scheduler, lambda: start("dask_worker", "--no-nanny", "--nthreads", "1")
    finally:
        for process in started:
            process.kill()
            process.wait()


def kill_dask_workers(study: Path, out: Path, kills: int) -> tuple[int, int]:
    """One sweep on Dask, whose workers are killed and replaced."""
    done = 0
    with dask(study.parent) as (address, _, worker):
        workers = [worker(), worker()]
        driver = sweep(study, out, "--scheduler", address)
        while driver.poll() is None:
            time.sleep(random.uniform(0.5, 2.0))
            if done < kills and Store(out).has_rows():
                workers.pop(random.randrange(2)).kill()
                workers.append(worker())
                done += 1
    return done, 1


def kill_dask_schedulers(study: Path, out: Path, kills: int) -> tuple[int, int]:
    """Sweeps on Dask whose scheduler is killed, then one whose is not."""
    done = 0
    for left in range(kills, -1, -1):
        with dask(study.parent) as (address, scheduler, worker):
            _, _ = worker(), worker()
            driver, shards = sweep(study, out, "--scheduler", address), num_shards(out)
            while left and driver.poll() is None and num_shards(out) == shards:
                time.sleep(0.05)
            if left:
                done += driver.poll() is None
                scheduler.kill()
            driver.wait()
    return done, kills + 1


CASES = {
    "workers": kill_workers,
    "drivers": kill_drivers,
    "dask workers": kill_dask_workers,
    "dask schedulers": kill_dask_schedulers,
}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=200)
    parser.add_argument("--kills", type=int, default=5)
    arguments = parser.parse_args()
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "kills.toml"
        path.write_text(STUDY % (arguments.episodes // 4))
        study = load_study(path)
        serial = {row.id: row.figures["state_hash"] for row in map(run_trial, trials(study, resolve(study)))}
        print(f"{'killed':15}  kills  sweeps  rows  distinct  lost  other hash", flush=True)
        for name, kill in CASES.items():
            out = Path(folder) / name
            kills, sweeps = kill(path, out, arguments.kills)
            rows = Store(out).rows(["id", "state_hash"]).to_pylist()
            found = {row["id"]: row["state_hash"] for row in rows}
            lost, other = len(serial.keys() - found), sum(serial[key] != value for key, value in found.items())
            bad += lost + other + len(rows) - len(found)
            figures = f"{sweeps:6}  {len(rows):4}  {len(found):8}  {lost:4}  {other:10}"
            print(f"{name:15}  {kills:5}  {figures}", flush=True)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
