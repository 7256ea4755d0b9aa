"""A controller that hangs, ends its process or crashes costs its own episode, and no other."""

import json
import os
import signal
import subprocess
import time

import pytest

from mjnav.study.cells import resolve
from mjnav.study.store.store import Store
from mjnav.study.study_file import load_study
from mjnav.study.sweep.schedulers import run_in_thread
from mjnav.study.sweep.sweep import trials
from tests.hanging_controllers import HANGING

PATIENCE = 120.0  # [s]
STUDY = """
schema = 1
name = "attack"
scenes = ["crossing1"]
seeds = [0]
set = { time_limit = 0.6, physics.engine = "kinematic" }
"""


@pytest.fixture
def study(tmp_path):
    """A study of `mean`, and of controllers that do not come back."""

    def write(*names: str):
        (tmp_path / "attacking.py").write_text(HANGING)
        methods = ["mean", *(f"attacking:{name}" for name in names)]
        text = STUDY + "".join(f'[[methods]]\ncontroller = "{method}"\n' for method in methods)
        (tmp_path / "attack.toml").write_text(text)
        return tmp_path / "attack.toml"

    return write


@pytest.fixture
def sweep(forked, tmp_path):
    """Starts a sweep of the study as a process of its own."""

    def start(*words: str) -> subprocess.Popen:
        command = [*forked, "sweep", "attack.toml", "-o", "out", "--workers", "1", *words]
        return subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    return start


def test_an_episode_that_hangs_or_exits_is_a_failed_row_among_the_others(study, sweep, tmp_path):
    study("Native", "Exiting")
    with sweep("--max-seconds", "1", "--json") as process:
        out, err = process.communicate()
    printed = json.loads(out)
    place = f"{tmp_path}/attacking.py:"
    assert (process.returncode, printed["run"], printed["failed"], err) == (1, 3, 2, "")
    hung, ended = sorted(printed["causes"])
    assert hung.startswith(f"a tick hangs ({place}")
    assert hung.endswith("): ended after 1 s on the wall (--max-seconds)")
    assert ended == "the worker died: exit code 0, as os._exit does"
    rows = Store(tmp_path / "out").rows(["method", "outcome", "error"]).to_pylist()
    assert {row["method"] for row in rows if row["error"] is None} == {"mean"}
    assert {row["outcome"] for row in rows if row["error"] is not None} == {None}


@pytest.mark.nightly
def test_an_interrupt_keeps_what_is_finished_also_where_an_episode_hangs(study, sweep, tmp_path):
    study("Hung")
    with sweep() as process:
        rows = Store(tmp_path / "out")
        ends = time.monotonic() + PATIENCE
        while not rows.has_rows():
            assert time.monotonic() < ends
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
    assert (process.returncode, "1 episodes are missing, --resume runs them" in err) == (130, True)
    with sweep("--resume", "--max-seconds", "1", "--json") as process:
        printed = json.loads(process.communicate()[0])
    assert (process.returncode, printed["kept"], printed["run"], printed["failed"]) == (1, 1, 1, 1)


def test_on_a_thread_of_another_program_a_hung_tick_is_ended_where_it_hangs(study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    file = load_study(study("Hung"))
    _, trial = trials(file, resolve(file))
    row = run_in_thread(trial, 0.2)
    assert row.error.startswith(f"a tick hangs ({tmp_path}{os.sep}attacking.py:")
    assert row.figures == {}
