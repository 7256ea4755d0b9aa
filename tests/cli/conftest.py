"""The command line, in this process and in one of its own."""

import subprocess
from dataclasses import dataclass

import pytest

from mjnav.cli.main import main


@dataclass(frozen=True)
class Said:
    code: int
    out: str
    err: str


@pytest.fixture
def mjnav(capsys, tmp_path, monkeypatch):
    """Calls the command line from an empty folder and returns what it said."""
    monkeypatch.chdir(tmp_path)

    def call(*words: object) -> Said:
        code = main([str(word) for word in words])
        return Said(code, *capsys.readouterr())

    return call


@pytest.fixture
def start(forked, tmp_path):
    """Starts the command line as a process of its own, from an empty folder."""
    started = []

    def start(*words: object, **options) -> subprocess.Popen:
        command = [*forked, *map(str, words)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": tmp_path}
        started.append(subprocess.Popen(command, **{**pipes, **options}))
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            process.kill()
        process.communicate()
