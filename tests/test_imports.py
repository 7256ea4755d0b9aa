"""Who imports whom, and what `import mjnav` costs."""

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from mjnav.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
COMPUTING = {"mujoco", "numba", "scipy", "matplotlib"}
HEAVY = {"mujoco", "numba", "numpy", "scipy", "matplotlib", "filterpy", "mcap", "google.protobuf", "rich"}


def test_imports_run_one_way():
    program = Path(sysconfig.get_path("scripts")) / "lint-imports"
    done = subprocess.run([program, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "0 broken" in done.stdout


@pytest.mark.parametrize(
    ("code", "allowed"),
    [
        ("import mjnav", set()),
        ("import mjnav.cli.main", set()),
        ("import mjnav, mjnav.errors; dir(mjnav); mjnav.__doc__", set()),
        ("import mjnav.messages, mjnav.rng", {"numpy"}),
        # A decision needs neither physics nor a log.
        ("from mjnav.control import make_controller", {"numpy"}),
        ("import mjnav.rkhs, mjnav.constraints", {"numpy"}),
    ],
)
def test_an_import_brings_only_what_it_needs(code, allowed):
    assert loaded_by(code) <= allowed


def test_help_is_told_without_any_of_it():
    assert loaded_by(told("--help")) == set()


def test_what_only_prints_compiles_computes_and_draws_nothing():
    printing = ["keys robot", "keys --controller rkhs", "list", "show hall", "schema run", "completion bash"]
    helps = [f"{command} --help" for command in COMMANDS]
    assert not loaded_by("\n".join(map(told, printing + helps))) & COMPUTING


def told(words: str) -> str:
    """Code that prints what a command prints."""
    return f"from mjnav.cli.main import main\ntry: main({words.split()})\nexcept SystemExit: pass"


def loaded_by(code: str) -> set[str]:
    """Which of HEAVY a fresh interpreter has loaded after `code`."""
    code += f"\nimport sys; print('loaded:', *({HEAVY!r} & set(sys.modules)))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=dict(os.environ)
    )
    assert done.stderr == ""
    return set(done.stdout.splitlines()[-1].removeprefix("loaded:").split())
