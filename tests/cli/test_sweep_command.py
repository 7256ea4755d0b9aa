"""`mjnav sweep`: what it prints, where it puts results and what it refuses."""

import json
import signal

import pytest

from mjnav.errors import missing_extra
from mjnav.study.store.store import Store

STUDY = """
schema = 1
name = "two methods"
scenes = ["crossing1"]
seeds = { count = 6 }
[set]
physics.engine = "kinematic"
time_limit = 0.5
[[methods]]
controller = "rkhs"
[[methods]]
controller = "mean"
"""
FAILING = """
from mjnav.control.methods.rkhs import Rkhs


class Failing(Rkhs):
    def decide(self, observation):
        if observation.time > 0.2:
            raise ZeroDivisionError("half way")
        return super().decide(observation)
"""

LEAVING = """
from mjnav.control.methods.mean import Mean


class Mute(BaseException):
    def __str__(self):
        raise ValueError("no text")


class Leaving(Mean):
    def decide(self, observation):
        raise {}
"""

MOVING = """
import os

from mjnav.control.methods.mean import Mean

os.chdir("/")


class Moving(Mean):
    def decide(self, observation):
        os.chdir("/")
        return super().decide(observation)
"""


@pytest.fixture
def sweep(mjnav, tmp_path):
    """Calls `mjnav sweep` on the study in one process."""
    (tmp_path / "two.toml").write_text(STUDY)
    return lambda *words, study="two.toml": mjnav("sweep", study, "--workers", 1, *words)


def test_it_says_what_it_runs_and_where_the_rows_are(sweep, tmp_path):
    said = sweep()
    assert (said.code, said.err) == (0, "")
    first, rest, last = said.out.splitlines()
    assert first == "two methods: 2 cells under 6 seeds are 12 episodes"
    assert rest.startswith("the rest: ")
    assert last.startswith("runs/out/two methods: 12 episodes, 12 of them in ")
    store = Store(tmp_path / "runs/out/two methods")
    assert len(store.done()) == 12
    assert store.study().startswith("# mjnav sweep two.toml ")
    assert store.study().endswith(STUDY)


def test_json_is_one_object_and_nothing_else(sweep):
    printed = json.loads(sweep("--json", "--seeds", 2).out)
    assert (printed["schema"], printed["study"], printed["folder"]) == (1, "two methods", "runs/out/two methods")
    assert {key: printed[key] for key in ("episodes", "kept", "run", "failed", "interrupted", "causes")} == {
        "episodes": 4, "kept": 0, "run": 4, "failed": 0, "interrupted": False, "causes": {}
    }  # fmt: skip
    assert 0.0 < printed["episode_seconds"] < printed["seconds"]


def test_a_dry_run_names_the_cells_and_runs_nothing(sweep, tmp_path):
    said = sweep("--dry-run", "--scene", "lane", "--set", "noise.profile=none")
    assert said.out.splitlines()[1:] == [
        "scene lane, setting default, method rkhs",
        "scene lane, setting default, method mean",
    ]
    assert json.loads(sweep("--dry-run", "--json").out) == {
        "schema": 1, "study": "two methods", "episodes": 12, "cells": 2
    }  # fmt: skip
    assert not (tmp_path / "runs").exists()


def test_an_episode_that_breaks_is_counted_by_its_cause_and_can_be_retried(sweep, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "failing_controllers.py").write_text(FAILING)
    (tmp_path / "two.toml").write_text(STUDY.replace('"mean"', '"failing_controllers:Failing"'))
    said = sweep("--seeds", 2)
    assert (said.code, said.err) == (1, "")
    cause, retry = said.out.splitlines()[-2:]
    assert cause.startswith("  2 failed: ")
    assert "ZeroDivisionError: half way" in cause
    assert retry == "  --retry-failed runs them again"
    assert "4 episodes, 0 of them" in sweep("--seeds", 2, "--resume").out
    assert "4 episodes, 2 of them" in sweep("--seeds", 2, "--retry-failed").out


def test_whatever_a_plugin_raises_is_the_cause_in_its_row(sweep, tmp_path):
    text = STUDY
    for method, raised in {"rkhs": "SystemExit(0)", "mean": "Mute"}.items():
        (tmp_path / f"{method}.py").write_text(LEAVING.format(raised))
        text = text.replace(f'"{method}"', f'"{method}.py:Leaving"')
    (tmp_path / "two.toml").write_text(text)
    said = sweep("--seeds", 1)
    assert (said.code, said.err) == (1, "")
    causes = sorted(Store("runs/out/two methods").causes())
    assert [cause.partition(" (")[0] for cause in causes] == ["Mute: its __str__ raises", "SystemExit: 0"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--workers", "0"], "mjnav: --workers: found 0; allowed: a whole number >= 1"),
        (["--seeds", "0"], "mjnav: --seeds: found 0; allowed: a whole number from 1"),
        (["--scene", "hal"], "mjnav: --scene: scene: found 'hal'"),
        (["--set", "time_limt=3"], "mjnav: --set: time_limt: found 'time_limt'"),
        (["--scheduler", "there", "--workers", "2"], "mjnav: argument --"),
        (["-o", "two.toml/out"], "mjnav: two.toml/out: Not a directory"),
    ],
)
def test_bad_input_is_refused_before_anything_starts(mjnav, tmp_path, monkeypatch, words, line):
    monkeypatch.setattr("mjnav.study.trial.Episode", pytest.fail)
    (tmp_path / "two.toml").write_text(STUDY)
    said = mjnav("sweep", "two.toml", *words)
    assert said.code == 2
    assert line in said.err
    assert "Traceback" not in said.err
    assert not (tmp_path / "runs").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_keeps_what_is_done_and_says_how_to_go_on(sweep, monkeypatch, number):
    before = signal.getsignal(number)
    asked = []

    def interrupt(self, done, row):
        asked.append(done)
        if done == 3:
            signal.raise_signal(number)

    monkeypatch.setattr("mjnav.cli.sweep._Watch.progress", interrupt)
    said = sweep()
    assert (said.code, asked) == (130, [1, 2, 3])
    assert said.err == "mjnav: interrupted: 9 episodes are missing, --resume runs them\n"
    assert len(Store("runs/out/two methods").done()) == 3
    assert signal.getsignal(number) is before


def test_without_the_extra_it_says_what_to_install(sweep, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    said = sweep()
    assert (said.code, said.err) == (2, f"mjnav: {missing_extra('pyarrow', 'sweep')}\n")
