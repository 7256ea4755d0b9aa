"""A file of numba's settings in a folder of downloads neither leads to foreign machine code nor decides what runs."""

import hashlib
import os
import pickle
import subprocess
import sys

import pytest

from mjnav.cli.main import main

PROGRAM = """
import numpy as np
from mjnav.compile.compiled import exact

@exact
def twice(x):
    return 2.0 * x

assert twice(1.5) == 3.0
"""


def run(folder, **variables: str) -> str:
    """What a process in `folder` says that compiles or loads a kernel; "" where it ends well."""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"XDG_CACHE_HOME": str(folder / "own"), **variables}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=folder, env=environment, capture_output=True, check=False
    )
    return done.stderr.decode() or ("" if done.returncode == 0 else str(done.returncode))


class Hostile:
    def __init__(self, command: str):
        self.command = command

    def __reduce__(self):
        return os.system, (self.command,)


def test_it_names_no_folder_of_kernels(tmp_path):
    pytest.importorskip("yaml", reason="numba reads the file with PyYAML")
    ran, cache = tmp_path / "ran", tmp_path / "downloads"
    assert run(tmp_path, NUMBA_CACHE_DIR=str(cache)) == ""
    (path,) = cache.rglob("twice-*.kernel")
    forged = pickle.dumps(Hostile(f"touch {ran}"))
    path.write_bytes(hashlib.sha256(path.stem.encode() + b"\0" + forged).digest() + forged)
    (tmp_path / ".numba_config.yaml").write_text(f"cache_dir: {cache}\n")
    assert run(tmp_path) == ""
    assert not ran.exists()
    assert len(list((tmp_path / "own").rglob("twice-*.kernel"))) == 1
    run(tmp_path, NUMBA_CACHE_DIR=str(cache))  # whoever names the folder in the environment trusts it
    assert ran.exists()


@pytest.mark.parametrize("command", ["list", "run crossing1"])
def test_no_command_runs_beside_it(tmp_path, monkeypatch, capsys, command):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\n")
    code, said = main(command.split()), capsys.readouterr()
    assert (code, said.out) == (2, "")
    assert said.err.startswith("mjnav: .numba_config.yaml in the working folder would change how mjnav compiles: ")
    assert [path.name for path in tmp_path.iterdir()] == [".numba_config.yaml"]
