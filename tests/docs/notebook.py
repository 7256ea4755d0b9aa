"""A page's blocks run in order in an empty folder: bash each by itself, python in one process for the whole page.

`mjnav` in bash is the installed program, or, where a notebook is given a fork server, a process forked by that.
"""

import json
import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.blocks import Block
from tests.forking import around

LONGEST = 120.0  # [s] that one block may take
INTERPRETER = """
import json as _json, os as _os, sys as _sys
for _line in _os.fdopen(int(_sys.argv[1])):
    _file, _before, _code = _json.loads(_line)
    exec(compile("\\n" * _before + _code, _file, "exec"), globals())
    _sys.stdout.flush()
    _os.write(int(_sys.argv[2]), b".")
"""


class Notebook:
    """A context in which blocks run; `folder` is their working folder, `server` the socket of `tests/forking`."""

    def __init__(self, folder: Path, server: str | None = None) -> None:
        self._folder = folder
        self._output = folder.with_suffix(".output")
        self._python: subprocess.Popen | None = None
        programs = str(Path(sys.executable).parent)  # where `mjnav` is
        if server is not None:
            programs = f"{around.programs(server, folder.with_suffix('.programs'))}:{programs}"
        # Without what `main`, called by tests of this process, sets for its children.
        own = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
        self._environment = {**own, "PATH": f"{programs}:{os.environ['PATH']}", "COLUMNS": "110"}

    def __enter__(self) -> "Notebook":
        return self

    def __exit__(self, *exception: object) -> None:
        if self._python is not None:
            self._python.kill()
            self._python.wait()
            os.close(self._blocks)
            os.close(self._done)

    def play(self, block: Block) -> None:
        """Writes or runs a block; one that fails or takes too long fails the test, with page, line and output."""
        if block.caption:
            file = self._folder / block.caption
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.code, encoding="utf-8")
        elif block.runs:
            ended = (self._run_bash if block.language == "bash" else self._run_python)(block)
            if ended != "done":
                shown = self._output.read_text(encoding="utf-8", errors="replace")
                pytest.fail(f"{block}: {ended}\n\n{block.code}\n{shown}", pytrace=False)

    def _run_bash(self, block: Block) -> str:
        with self._output.open("wb") as output:
            words = ["bash", "-e", "-c", block.code]
            pipes = {"stdin": subprocess.DEVNULL, "stdout": output, "stderr": subprocess.STDOUT}
            try:
                code = subprocess.run(
                    words, cwd=self._folder, env=self._environment, timeout=LONGEST, **pipes
                ).returncode
            except subprocess.TimeoutExpired:
                return f"still running after {LONGEST:.0f} s"
        return "done" if code == 0 else f"exit code {code}"

    def _run_python(self, block: Block) -> str:
        python = self._python or self._start_python()
        source = (str(block.page), block.line - 1, block.code)  # a traceback names the page and its line
        os.write(self._blocks, f"{json.dumps(source)}\n".encode())
        if not select.select([self._done], [], [], LONGEST)[0]:
            return f"still running after {LONGEST:.0f} s"
        return "done" if os.read(self._done, 1) else f"exit code {python.wait()}"

    def _start_python(self) -> subprocess.Popen:
        blocks_in, self._blocks = os.pipe()
        self._done, done_in = os.pipe()
        with self._output.open("wb") as output:
            self._python = subprocess.Popen(
                [sys.executable, "-c", INTERPRETER, str(blocks_in), str(done_in)],
                cwd=self._folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                pass_fds=(blocks_in, done_in),
            )
        os.close(blocks_in)
        os.close(done_in)
        return self._python
