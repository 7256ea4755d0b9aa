"""A sweep never adds to rows that were made with something else unasked, and says in words what that is.

Each attack is a process of its own on a copy of one folder of results.
"""

import hashlib
import json
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from mjnav.study.store import Store

STUDY = """
schema = 1
name = "own"
scenes = ["./scene.toml"]
seeds = { count = 2 }
[[methods]]
controller = "own_controllers:Own"
"""
SCENE = """
schema = 1
name = "short"
time_limit = 0.3
[robot]
start = [0.0, 0.0, 0.0]
goal = [3.0, 0.0]
[physics]
engine = "kinematic"
"""
CONTROLLER = """
from dataclasses import dataclass

from own_risk import FACTOR

from mjnav.control.base import WeightedController, sample_risk
from mjnav.control.parameters import WeightedParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnParameters(WeightedParameters):
    worst: float = 3.0


class Own(WeightedController[OwnParameters]):
    parameters_type = OwnParameters

    def risk(self, problem):
        return sample_risk(problem, lambda samples: FACTOR * self.parameters.worst * samples.max(axis=0))
"""
FILES = {"own.toml": STUDY, "scene.toml": SCENE, "own_controllers.py": CONTROLLER, "own_risk.py": "FACTOR = 1.0\n"}
RESULTS = "runs/out/own"


def mjnav_process(program: Sequence[str], folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """`mjnav` in a process of its own, begun in `folder`."""
    return subprocess.run([*program, *words], cwd=folder, capture_output=True, text=True, timeout=120, check=False)


def sweep(program: Sequence[str], folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return mjnav_process(program, folder, "sweep", "own.toml", "--workers", "1", *words)


def state(folder: Path) -> dict[str, tuple[str, int]]:
    """Content and time of every file."""
    return {
        str(path.relative_to(folder)): (hashlib.sha256(path.read_bytes()).hexdigest(), path.stat().st_mtime_ns)
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def swept(forked, tmp_path_factory) -> Path:
    """A folder with the study, its controller and the results of one seed."""
    folder = tmp_path_factory.mktemp("swept")
    for name, text in FILES.items():
        (folder / name).write_text(text)
    said = sweep(forked, folder, "--seeds", "1")
    assert (said.returncode, said.stderr) == (0, ""), said
    return folder


@pytest.fixture
def copy(swept, tmp_path) -> Path:
    folder = tmp_path / "copy"
    shutil.copytree(swept, folder, ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def edit(folder: Path, name: str, old: str, new: str) -> None:
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))


def test_an_edit_of_a_controller_of_what_it_imports_and_of_the_scene_is_told(forked, copy):
    edit(copy, "own_controllers.py", "    worst: float = 3.0", "    worst: float = 4.0\n    least: int = 7")
    edit(copy, "own_risk.py", "1.0", "2.0")
    edit(copy, "scene.toml", "time_limit = 0.3", "time_limit = 0.4")
    before = state(copy / "runs")
    said = sweep(forked, copy, "--resume")
    assert (said.returncode, said.stderr.count("\n")) == (2, 1), said
    assert said.stderr.startswith(f"mjnav: {RESULTS}: not the same as when its rows were made: ")
    for told in (
        "own_controllers.py changed (1 row)",
        "own_risk.py changed (1 row)",
        "control.least was absent, is 7 (1 row)",
        "control.worst was 3.0, is 4.0 (1 row)",
        "time_limit was 0.3, is 0.4 (1 row)",
        "--accept-changed",
    ):
        assert told in said.stderr
    assert state(copy / "runs") == before


def test_what_was_accepted_is_kept_and_every_table_says_so(forked, copy):
    edit(copy, "own_risk.py", "1.0", "2.0")
    said = sweep(forked, copy, "--resume", "--accept-changed")
    assert (said.returncode, said.stderr) == (0, "")
    rows = Store(copy / RESULTS).rows(["seed", "sources_controller", "row_schema"]).to_pylist()
    assert sorted(row["seed"] for row in rows) == [0, 1]  # no seed twice
    assert len({row["sources_controller"] for row in rows}) == 2
    compared = mjnav_process(forked, copy, "compare", RESULTS, "--json")
    (mixture,) = json.loads(compared.stdout)["made_with"]
    assert mixture["what"] == "the sources of plug-ins own_controllers:Own"
    assert list(mixture["rows"].values()) == [1, 1]
    assert all(value.startswith("own_risk.py ") for value in mixture["rows"])


def test_an_unchanged_sweep_goes_on_without_a_word(forked, copy):
    said = sweep(forked, copy, "--resume", "--dry-run")
    assert (said.returncode, said.stderr) == (0, ""), said
