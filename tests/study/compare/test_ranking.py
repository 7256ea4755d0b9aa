"""The settings of a method by their score: the rule, the order, and the line that gives a study the best of them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from mjnav.cli.main import main
from mjnav.study.cells import resolve
from mjnav.study.compare.ranking import rank
from mjnav.study.store import Store
from mjnav.study.study_file import load_study
from mjnav.study.sweep.sweep import sweep, trials
from mjnav.study.trial import run_trial
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

STUDY = """
schema = 1
name = "made up"
scenes = ["crossing1", "crossing2"]
seeds = { count = 2 }
set = { physics.engine = "kinematic", time_limit = 0.5 }
[[methods]]
controller = "rkhs"
name = "mine"
set = { degree = 2 }
search = { count = 3, weight = { low = 1.0, high = 9.0 }, robot.min_speed = { low = -0.5, high = 0.0 } }
[[methods]]
controller = "mean"
"""
LIMIT = {"scenario": "time_limit = 100.0"}


@pytest.fixture
def study(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY)
    return load_study(tmp_path / "study.toml")


@pytest.fixture
def store(tmp_path):
    """Rows of two settings and of the other method, and one of a third setting; time is ten times the cost."""
    rows = [
        *(row("mine #1", seed, 2.0, scene=scene, **LIMIT) for scene in ("crossing1", "crossing2") for seed in range(2)),
        row("mine #2", 0, 1.0, scene="crossing1", **LIMIT),
        row("mine #2", 1, 1.0, hit=True, scene="crossing1", **LIMIT),
        row("mine #2", 0, 1.0, success=False, scene="crossing2", **LIMIT),  # the time was up
        row("mine #2", 1, 1.0, error="broken", scene="crossing2", **LIMIT),
        row("mine #3", 0, 20.0, scene="crossing1", **LIMIT),  # goal reached, at a score that would be below 0
        row("mean", 0, 1.0, scene="crossing1", **LIMIT),
    ]
    (tmp_path / "out").mkdir()
    store = Store(tmp_path / "out")
    store.append(rows)
    return store


def test_the_score_is_the_stated_one_and_the_best_mean_comes_first(store, study):
    mine, mean = rank(store, study)
    assert [one.label for one in mine.settings] == ["mine #1", "mine #3", "mine #2"]
    found = [one.score.value for one in mine.settings]
    np.testing.assert_allclose(
        found, [1.0 - 0.5 * 20.0 / 100.0 - 0.1, 0.0, (1.0 - 0.5 * 0.1 - 0.1 * 1.0 / 2.0 - 3.0 + 0.0 - 3.0) / 4]
    )
    assert [(one.episodes, one.failed) for one in mine.settings] == [(4, 0), (1, 0), (4, 1)]
    assert (mine.num_missing, mean.num_missing, mean.controller) == (3, 3, "mean")
    assert mine.settings[2].figures["collision"].value == pytest.approx(1 / 3)


def test_what_is_missing_is_counted_by_the_studys_own_episodes(store, study):
    """A seed more than the study's makes up for none, and a scene without rows lacks all."""
    store.append([row("mine #1", 2, 2.0, scene="crossing1", **LIMIT)])
    mine, _ = rank(store, replace(study, scenes=("crossing1", "crossing2", "blind7")))
    assert mine.num_missing == 3 + 3 * 2


def test_the_line_of_a_setting_makes_the_same_cell(store, study, tmp_path):
    asked = resolve(study, scenes=["crossing1"])
    for one in rank(store, study)[0].settings:
        (tmp_path / "one.toml").write_text(
            f'{STUDY.partition("[[methods]]")[0]}[[methods]]\ncontroller = "rkhs"\n{one.toml}'
        )
        (cell,) = resolve(load_study(tmp_path / "one.toml"), scenes=["crossing1"])
        expected = next(other for other in asked if other.method == one.label)
        assert (cell.document, cell.control) == (expected.document, expected.control)


def test_an_interrupted_search_goes_on_also_with_a_larger_count(study, tmp_path, capsys):
    store = Store(tmp_path / "swept")

    def serial(wanted):
        yield from map(run_trial, wanted)

    asked = trials(study, resolve(study, scenes=["crossing1"]))
    done: list[int] = []
    sweep(asked, store, serial, progress=lambda num, row: done.append(num), stop=lambda: len(done) >= 3)
    before = set(store.rows(["id"])["id"].to_pylist())
    assert len(before) == 3
    larger = tmp_path / "study.toml"
    larger.write_text(STUDY.replace("count = 3", "count = 4"))
    asked = trials(load_study(larger), resolve(load_study(larger), scenes=["crossing1"]))
    report = sweep(asked, store, serial, text=larger.read_text(), resume=True)
    assert (report.episodes, report.kept, report.run, report.failed) == (10, 3, 7, 0)
    assert before < set(store.rows(["id"])["id"].to_pylist())
    assert main(["compare", str(store.folder), "--rank", "--json"]) == 0
    first, second = json.loads(capsys.readouterr().out)["methods"]
    assert {one["label"] for one in first["settings"]} == {f"mine #{i}" for i in range(1, 5)}
    assert (first["missing"], second["missing"], first["settings"][0]["episodes"]) == (8, 2, 2)  # of crossing2
