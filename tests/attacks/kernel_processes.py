"""kernel_processes.py: a process that has imported numba, and the programs that it forks off, one for each attack.

`Kernels(sources).run(program, environment)` runs a Python program in a process that has numba, but nothing of mjnav,
which it imports from the folder `sources`. Compiling is real; only numba's own second of start-up is paid for once.
"""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

SERVER = """
import json, os, sys
import numba
from numba.core.registry import cpu_target

@numba.njit
def warm(x):
    return x + 1.0

warm(1.0)  # the target's own start
for line in sys.stdin:
    program, environments, out = json.loads(line)
    children = {}
    for i, environment in enumerate(environments):
        number = os.fork()
        if number == 0:
            for target, name in ((1, "out"), (2, "err")):
                os.dup2(os.open(f"{out}/{i}.{name}", os.O_WRONLY | os.O_CREAT), target)
            os.environ.update(environment)
            sys.path.insert(0, environment["SOURCES"])
            code = 1
            try:
                exec(compile(program, "<program>", "exec"), {"__name__": "__main__"})
                sys.stdout.flush()
                code = 0
            finally:
                sys.excepthook(*sys.exc_info()) if code else None
                sys.stderr.flush()
                os._exit(code)
        children[number] = i
    codes = [None] * len(children)
    for _ in environments:
        number, status = os.wait()
        codes[children[number]] = os.waitstatus_to_exitcode(status)
    print(json.dumps(codes), flush=True)
"""


@dataclass(frozen=True)
class Ended:
    """How a program ended."""

    code: int
    out: str
    err: str


class Kernels:
    """The process that forks. Closed at the end of a `with` block."""

    def __enter__(self):
        environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"}
        environment["PYTHONDONTWRITEBYTECODE"] = "1"  # Python's own takes an edit of the same size and time for no edit
        command = [sys.executable, "-c", SERVER]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
        self._server = subprocess.Popen(command, env=environment, cwd="/", **pipes)
        return self

    def __exit__(self, *error):
        self._server.stdin.close()
        self._server.wait()
        self._server.stdout.close()

    def run(self, program, *environments):
        """The program in one process for each environment, all at once; SOURCES is the folder with mjnav in it."""
        with tempfile.TemporaryDirectory() as out:
            self._server.stdin.write(json.dumps([program, environments, out]) + "\n")
            self._server.stdin.flush()
            codes = json.loads(self._server.stdout.readline())
            texts = [[Path(out, f"{i}.{name}").read_text() for name in ("out", "err")] for i in range(len(codes))]
        return [Ended(code, *text) for code, text in zip(codes, texts, strict=True)]
