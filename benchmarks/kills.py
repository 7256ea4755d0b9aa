"""What a SIGKILL costs: runs are killed at random moments, and their logs are compared with what they had reached.

    uv run python benchmarks/kills.py [SCENE] [--kills N] [--seed N]

Each run is a process of its own, in real time and headless by turns. It notes when it begins each tick in memory that
outlives it, so that the loss counts from the last tick that was begun, of which nothing can be in the log yet, back to
the last message that is: in simulated time, and in time on the wall.
"""

import argparse
import mmap
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

MAX_TICKS = 100_000
PATIENCE = 120.0  # [s]
# mjnav.run itself, told of each tick by its own argument
CHILD = """
import mmap, sys, time
import numpy as np
import mjnav
scene, log, noted, real_time = sys.argv[1:]
with open(noted, "r+b") as file:
    begun = np.frombuffer(mmap.mmap(file.fileno(), 0)).reshape(-1, 2)  # simulated time, time on the wall [s]
tick = 0
def note(now):
    global tick
    begun[tick] = now, time.monotonic()
    tick += 1
endless = ("time_limit=9999", "robot.goal_tolerance=0.001", "stop_on_collision=false")
scenario = mjnav.load_scenario(scene, endless)
mjnav.run(scenario, real_time=bool(int(real_time)), log=log, progress=note)
"""


def kill_one(scene: str, folder: Path, real_time: bool, lifetime: float) -> tuple[float, float, int]:
    """Loss in simulated time and on the wall [s], and how many ticks the log kept, of a run killed at `lifetime`."""
    from mjnav import open_log

    log, noted = folder / "run.mcap", folder / "noted"
    noted.write_bytes(bytes(16 * MAX_TICKS))
    with open(noted, "r+b") as file:
        begun = np.frombuffer(mmap.mmap(file.fileno(), 0)).reshape(-1, 2)
    command = [sys.executable, "-c", CHILD, scene, str(log), str(noted), str(int(real_time))]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        patience = time.monotonic() + PATIENCE
        while begun[0, 1] == 0.0:
            if time.monotonic() > patience or process.poll() is not None:
                raise SystemExit("the run did not begin")
            time.sleep(0.005)
        time.sleep(max(0.0, begun[0, 1] + lifetime - time.monotonic()))
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    num = int(np.count_nonzero(begun[:, 1]))
    found = open_log(log)
    assert found.truncated
    assert found.duration is not None
    kept = int(np.searchsorted(begun[:num, 0], found.duration + 1e-6))
    loss = begun[num - 1] - begun[kept - 1]
    log.unlink()
    return float(loss[0]), float(loss[1]), kept


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    lifetimes = np.random.default_rng(arguments.seed).uniform(0.3, 3.0, arguments.kills)
    for real_time in (True, False):
        with tempfile.TemporaryDirectory(prefix="mjnav-kills-") as folder:
            runs = np.array([kill_one(arguments.scene, Path(folder), real_time, float(t)) for t in lifetimes])
        simulated, wall, kept = runs.T
        print(
            f"{arguments.scene}, {'real time' if real_time else 'headless'}, {arguments.kills} kills after 0.3 to 3 s "
            f"({kept.min():.0f} to {kept.max():.0f} ticks kept): lost {np.median(simulated):.3f} s of simulated time "
            f"median, {simulated.max():.3f} max; {np.median(wall):.3f} s on the wall median, {wall.max():.3f} max",
            flush=True,
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
