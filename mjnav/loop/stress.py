"""Load beside a real-time test: a process for every CPU that computes, and one that writes to the disk.

Each is ended when the context closes, and ends itself when its parent is gone.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

_COMPUTE = "import os\nparent = os.getppid()\nwhile os.getppid() == parent:\n    sum(i * i for i in range(200_000))\n"
_WRITE = """
import os, sys
parent, block = os.getppid(), os.urandom(1 << 20)
with open(sys.argv[1], "wb") as file:
    while os.getppid() == parent:
        file.seek(0)
        for _ in range(16):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
"""


@contextmanager
def stress() -> Iterator[str]:
    """Runs the load; yields what it is, in words."""
    num_cpus = len(os.sched_getaffinity(0))
    with tempfile.NamedTemporaryFile(prefix="mjnav-stress-") as file:
        commands = [[sys.executable, "-c", _COMPUTE]] * num_cpus + [[sys.executable, "-c", _WRITE, file.name]]
        processes: list[subprocess.Popen] = []
        try:
            processes += [subprocess.Popen(command) for command in commands]
            yield f"{num_cpus} computing processes and one that writes and syncs 16 MiB over and over"
        finally:
            for process in processes:
                process.kill()
            for process in processes:
                process.wait()
