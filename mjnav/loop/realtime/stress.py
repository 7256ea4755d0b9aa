"""Load beside a real-time test: a process for every CPU that computes, and one that writes to the disk.

Each ends when the context closes, or when its parent has died.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

_COMPUTE = """
import os, sys
while os.getppid() == int(sys.argv[1]):
    sum(i * i for i in range(200_000))
"""
_WRITE = """
import os, sys
block = os.urandom(1 << 20)
with open(sys.argv[2], "wb") as file:
    while os.getppid() == int(sys.argv[1]):
        file.seek(0)
        for _ in range(16):
            file.write(block)
        file.flush()
        os.fsync(file.fileno())
"""


@contextmanager
def stress() -> Iterator[str]:
    """Runs the load; yields what it is, in words."""
    num_cpus, parent = len(os.sched_getaffinity(0)), str(os.getpid())
    with tempfile.NamedTemporaryFile(prefix="mjnav-stress-") as file:
        programs = [(_COMPUTE, parent)] * num_cpus + [(_WRITE, parent, file.name)]
        processes: list[subprocess.Popen] = []
        try:
            for program in programs:  # in sessions of their own: an interrupt at the terminal is not theirs to answer
                processes.append(subprocess.Popen([sys.executable, "-P", "-c", *program], start_new_session=True))
            yield f"{num_cpus} computing processes and one that writes and syncs 16 MiB over and over"
        finally:
            for process in processes:
                process.kill()
            for process in processes:
                process.wait()
