"""A sweep never adds to rows that were made with something else unasked, and says in words what that is.

Each attack is a process of its own on a copy of one folder of results.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import mjnav
from mjnav.study.store.store import Store, digest

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


@dataclass(frozen=True)
class Said:
    code: int
    out: str
    err: str


STARTED = (sys.executable, "-m", "mjnav.cli.main")


def mjnav_process(program: Sequence[str], folder: Path, *words: str, **environment: str) -> Said:
    """`mjnav` in a process of its own, begun in `folder`."""
    done = subprocess.run(
        [*program, *words], cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=120
    )
    return Said(done.returncode, done.stdout, done.stderr)


def sweep(program: Sequence[str], folder: Path, *words: str, **environment: str) -> Said:
    return mjnav_process(program, folder, "sweep", "own.toml", "--workers", "1", *words, **environment)


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
    assert (said.code, said.err) == (0, ""), said
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


def assert_refused(program: Sequence[str], folder: Path, *told: str, **environment: str) -> None:
    """The sweep names each change in one line, and leaves every file as it was."""
    before = state(folder / "runs")
    said = sweep(program, folder, "--resume", **environment)
    assert (said.code, said.err.count("\n")) == (2, 1), said
    assert said.err.startswith(f"mjnav: {RESULTS}: not the same as when its rows were made: ")
    assert "--accept-changed" in said.err
    assert [text for text in told if text not in said.err] == [], said.err
    assert state(folder / "runs") == before


def test_an_edit_of_a_controller_of_what_it_imports_and_of_the_scene_is_told(forked, copy):
    edit(copy, "own_controllers.py", "    worst: float = 3.0", "    worst: float = 4.0\n    least: int = 7")
    edit(copy, "own_risk.py", "1.0", "2.0")
    edit(copy, "scene.toml", "time_limit = 0.3", "time_limit = 0.4")
    assert_refused(
        forked,
        copy,
        "own_controllers.py changed (1 row)",
        "own_risk.py changed (1 row)",
        "control.least was absent, is 7 (1 row)",
        "control.worst was 3.0, is 4.0 (1 row)",
        "time_limit was 0.3, is 0.4 (1 row)",
    )


def test_another_mjnav_and_another_code_path_on_the_same_machine_are_told(copy, tmp_path):
    source, another = Path(mjnav.__file__).parents[1], tmp_path / "another"
    for part in ("mjnav", "models", "runs"):
        shutil.copytree(source / part, another / part, ignore=shutil.ignore_patterns("out", "*.nbi", "*.nbc"))
    with open(another / "mjnav/geometry/angles.py", "a") as file:
        file.write("# another comment\n")
    processor = os.environ.get("NUMBA_CPU_NAME", "host")
    told = [
        "mjnav's sources changed (1 row)",
        f"the processor that kernels are compiled for was {processor}, is nehalem",
    ]
    features = (np.show_config(mode="dicts") or {}).get("SIMD Extensions", {}).get("found", [])
    told += ["the processor features that NumPy uses: without "] * bool(features)
    assert_refused(
        STARTED,
        copy,
        *told,
        PYTHONPATH=str(another),
        NUMBA_CPU_NAME="nehalem",
        NPY_DISABLE_CPU_FEATURES=" ".join([os.environ.get("NPY_DISABLE_CPU_FEATURES", ""), *features]),
    )


def test_what_was_accepted_is_kept_and_every_table_says_so(forked, copy):
    edit(copy, "own_risk.py", "1.0", "2.0")
    said = sweep(forked, copy, "--resume", "--accept-changed")
    assert (said.code, said.err) == (0, "")
    rows = Store(copy / RESULTS).rows(["seed", "sources_controller", "row_schema"]).to_pylist()
    assert sorted(row["seed"] for row in rows) == [0, 1]  # no seed twice
    assert len({row["sources_controller"] for row in rows}) == 2
    compared = mjnav_process(forked, copy, "compare", RESULTS, "--json")
    (mixture,) = json.loads(compared.out)["made_with"]
    assert mixture["what"] == "the sources of plug-ins own_controllers:Own"
    assert list(mixture["rows"].values()) == [1, 1]
    assert all(value.startswith("own_risk.py ") for value in mixture["rows"])


def test_a_folder_of_an_earlier_version_is_read_and_told(forked, copy):
    (shard,) = (copy / RESULTS).glob("part-*.parquet")
    table = pq.read_table(shard)
    new = [name for name in table.column_names if name.startswith(("version_", "sources_", "cpu", "kernels", "blas"))]
    older = table.drop_columns([*new, "python", "libc", "row_schema", "control"])
    pq.write_table(older, shard)
    shard.rename(shard.with_name(f"part-000000-{digest(shard.read_bytes())}.parquet"))
    said = sweep(forked, copy, "--resume")
    assert said.code == 2
    assert "written by an earlier version of mjnav, which did not record " in said.err


def test_an_unchanged_sweep_goes_on_without_a_word(forked, copy):
    said = sweep(forked, copy, "--resume", "--dry-run")
    assert (said.code, said.err) == (0, ""), said
