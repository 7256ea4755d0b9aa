"""cold_processes.py: many processes that all find an empty kernel cache, and some of them killed while they compile.

    uv run python tests/attacks/cold_processes.py [--processes N] [--killed K]

Prints how each ended and how many kernels were compiled in all. Every process that was not killed ends with the same
state hash, and none reads a file that is half written.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = """
import mjnav
from numba.core import event
recorder = event.RecordingListener()
event.register("numba:compile", recorder)
result = mjnav.run(mjnav.load_scenario("crossing1", ["time_limit=0.5"]))
print(result.summary["state_hash"], sum(e.is_start for _, e in recorder.buffer))
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--processes", type=int, default=20)
    parser.add_argument("--killed", type=int, default=0, help="how many more are killed after a few seconds each")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as cache:
        environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        environment["XDG_CACHE_HOME"] = cache
        start = time.monotonic()
        command = [sys.executable, "-c", PROGRAM]
        processes = [
            subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            for _ in range(arguments.processes + arguments.killed)
        ]
        for victim in processes[arguments.processes :]:
            time.sleep(3.0)
            victim.kill()
            victim.communicate()
        ended = [process.communicate() for process in processes[: arguments.processes]]
        seconds = time.monotonic() - start
        left = [path.name for path in Path(cache).rglob("*.tmp")]
        kernels = len(list(Path(cache).rglob("*.kernel")))
    hashes = {out.split()[0] if out else "none" for out, _ in ended}
    compiled = [int(out.split()[1]) for out, _ in ended if out]
    codes = sorted({process.returncode for process in processes[: arguments.processes]})
    print(f"processes  {arguments.processes}, {arguments.killed} more killed; {seconds:.0f} s")
    print(f"exit codes {codes}; said on standard error: {sorted({err.strip() for _, err in ended})}")
    print(f"hashes     {sorted(hashes)}")
    print(f"compiled   {sum(compiled)} times in all, {max(compiled, default=0)} by one process")
    print(f"files      {kernels} of kernels, {len(left)} unfinished")
    return 0 if codes == [0] and len(hashes) == 1 and len(left) <= arguments.killed else 1


if __name__ == "__main__":
    sys.exit(main())
