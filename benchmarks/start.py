"""How long mjnav takes to start: what only prints as a whole, and `mjnav run` from process start to its first tick.

    uv run python benchmarks/start.py [--cold]

`--cold` first runs once with an empty folder for compiled kernels, as on a machine that never ran mjnav.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time

COMMAND = [sys.executable, "-m", "mjnav.cli.main"]
# The first tick of the run proper: the ticks that warm up have no log.
TO_FIRST_TICK = """
import os, sys, time
from mjnav.log.write.writer import Recorder
def first(self, record):
    print(time.clock_gettime(time.CLOCK_MONOTONIC), flush=True)
    os._exit(0)
Recorder.write = first
from mjnav.cli.main import main
main(["run", sys.argv[1], "--log", sys.argv[2]])
"""


def seconds_to_first_tick(scene: str, cache: str | None = None) -> float:
    """From the start of the process to the first tick that is logged."""
    environment = {**os.environ, **({"NUMBA_CACHE_DIR": cache} if cache else {})}
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", TO_FIRST_TICK, scene, os.path.join(folder, "a.mcap")]
        start = time.clock_gettime(time.CLOCK_MONOTONIC)
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return float(done.stdout.split()[-1]) - start


def seconds(*words: str) -> float:
    """Of a whole command."""
    start = time.perf_counter()
    subprocess.run([*COMMAND, *words], capture_output=True, check=True)
    return time.perf_counter() - start


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default="hall")
    parser.add_argument("--cold", action="store_true")
    parser.add_argument("--repeat", type=int, default=5)
    arguments = parser.parse_args()
    if arguments.cold:
        with tempfile.TemporaryDirectory() as cache:
            print(f"first ever, compiling: {seconds_to_first_tick(arguments.scene, cache):.2f} s to the first tick")
    warm = [seconds_to_first_tick(arguments.scene) for _ in range(arguments.repeat + 1)][1:]
    print(f"warm: {min(warm):.2f} s to the first tick (least of {len(warm)}, most {max(warm):.2f} s)")
    for words in ("--help", "keys", "list"):
        taken = [seconds(words) for _ in range(arguments.repeat)]
        print(f"mjnav {words}: {min(taken):.3f} s (least of {len(taken)}, most {max(taken):.3f} s)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
