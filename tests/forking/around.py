"""around.py COMMAND...: runs a command for which `mjnav` is a process forked by `server.py`, which starts sooner.

The command finds that `mjnav` first in PATH, and its folder in MJNAV_PROGRAMS. The exit code is the command's.
"""

import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HERE = Path(__file__).parent


@contextmanager
def fork_server(address: Path) -> Iterator[str]:
    """The socket `address` of a `server.py` while it serves."""
    with subprocess.Popen(
        [sys.executable, str(HERE / "server.py"), str(address)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        start_new_session=True,
    ) as process:
        assert process.stdout.readline() == "ready\n"
        yield str(address)
        process.stdin.close()


def programs(server: str, folder: Path) -> Path:
    """The folder, made here, of an `mjnav` that the server forks."""
    folder.mkdir()
    words = shlex.join([sys.executable, "-IS", str(HERE / "command.py"), server])
    (folder / "mjnav").write_text(f'#!/bin/sh\nexec {words} "$@"\n')
    (folder / "mjnav").chmod(0o700)
    return folder


def main(command: list[str]) -> int:
    with tempfile.TemporaryDirectory() as folder, fork_server(Path(folder) / "socket") as server:
        found = str(programs(server, Path(folder) / "programs"))
        environment = {**os.environ, "MJNAV_PROGRAMS": found, "PATH": f"{found}:{os.environ['PATH']}"}
        return subprocess.run(command, env=environment, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
