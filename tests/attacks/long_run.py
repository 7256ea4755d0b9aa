"""Prints the resident memory of long runs: `uv run python tests/attacks/long_run.py [HOURS [NAME]]`.

An hour of `hall` (36 000 ticks) without a log (bare), and with one (logged); a minute against the clock at 200 Hz,
logged by a thread of its own (paced); and 60 episodes of one sweep worker (worker). Each in a process of its own, which
is looked at from outside.
"""

import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from statistics import linear_regression

ENDLESS = ["stop_on_collision=false", "robot.goal=[900.0, 0.0]"]
MJNAV = [sys.executable, "-m", "mjnav.cli.main"]
STUDY = """
schema = 1
name = "long"
scenes = ["crossing1"]
seeds = {{ count = {count} }}
[[methods]]
controller = "rkhs"
"""
MIB = 2**20


def run(*words: str, **settings: float) -> list[str]:
    changed = [*ENDLESS, *(f"{key.replace('__', '.')}={value}" for key, value in settings.items())]
    return [*MJNAV, "run", "hall", "--json", *words, *(word for one in changed for word in ("--set", one))]


def resident(process: int) -> int:
    """Bytes of the process and of all below it, of the largest."""
    children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return max(4096 * pages, *(resident(int(child)) for child in children), 0)


def watch(name: str, command: list[str], samples: int = 12) -> None:
    """Prints memory at so many moments of the run, and how much it grew since the first quarter."""
    with tempfile.TemporaryDirectory() as folder:
        began, seen = time.monotonic(), []
        with subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL) as process:
            while process.poll() is None:
                with suppress(OSError, ValueError):  # a process of it has just ended
                    seen.append((time.monotonic() - began, resident(process.pid) / MIB))
                time.sleep(0.5)
    chosen = seen[:: max(1, len(seen) // samples)]
    print(f"{name}: exit code {process.returncode}")
    print("  s    " + " ".join(f"{at:6.0f}" for at, _ in chosen))
    print("  MiB  " + " ".join(f"{size:6.1f}" for _, size in chosen))
    begin = next(size for at, size in seen if at > 0.15 * seen[-1][0])
    later = seen[len(seen) // 3 :]
    slope = linear_regression([at for at, _ in later], [size for _, size in later]).slope if len(later) > 2 else 0.0
    print(f"  {60.0 * slope:+.2f} MiB a minute over the last two thirds of {seen[-1][0]:.0f} s")
    print(f"  from {begin:.1f} to {max(size for _, size in seen):.1f} MiB: {max(s for _, s in seen) - begin:+.1f}\n")


if __name__ == "__main__":
    hours = float(sys.argv[1] if len(sys.argv) > 1 else 1.0)
    names = sys.argv[2:] or ["bare", "logged", "paced", "worker"]
    if "bare" in names:
        watch("without a log", run("--no-log", time_limit=3600.0 * hours))
    if "logged" in names:
        watch("with a log", run("--log", "a.mcap", time_limit=3600.0 * hours))
    if "paced" in names:
        watch(
            "paced, 200 Hz",
            run("--real-time", "--log", "a.mcap", time_limit=60.0, control__rate=200.0, physics__timestep=0.001),
        )
    if "worker" in names:
        with tempfile.TemporaryDirectory() as place:
            study = Path(place, "long.toml")
            study.write_text(STUDY.format(count=60))
            watch("a sweep's worker", [*MJNAV, "sweep", str(study), "-o", "out", "--workers", "1"])
