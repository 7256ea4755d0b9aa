"""An episode as a row, and the id that it is known by."""

from dataclasses import fields, replace
from typing import Any

import pyarrow as pa
import pytest

from mjnav import scene
from mjnav.loop.episode import Episode
from mjnav.loop.provenance import FACTS, provenance
from mjnav.metrics.summary import FIGURES
from mjnav.scene.spec import Control, Layout
from mjnav.study.cells import Cell, resolve
from mjnav.study.store.row import COLUMNS
from mjnav.study.study_file import MethodEntry, StudyFile
from mjnav.study.trial import Trial, failed_row, flatten, prepared, run_trial

CELL = Cell("scene", "setting", "method", "rkhs", "{}", "document")
NOT_IN_A_ROW = {"schema"}  # of a run's summary


def test_an_id_changes_with_every_part_of_the_episode():
    trial = Trial("study", CELL, 3)
    assert replace(trial, cell=replace(CELL)).id == trial.id
    names = [field.name for field in fields(Cell) if field.name != "controller"]  # the document has it
    others = [replace(trial, cell=replace(CELL, **{name: "other"})).id for name in names]
    others += [replace(trial, seed=4).id, replace(trial, study="other").id]
    assert len({trial.id, *others}) == 1 + len(others)


@pytest.mark.parametrize("fact", FACTS)
def test_an_id_changes_with_every_fact_that_decides_bits(monkeypatch, fact):
    trial, facts = Trial("study", CELL, 3), provenance("rkhs")
    before = trial.id
    monkeypatch.setattr("mjnav.study.trial.provenance", lambda method, plugins: {**facts, fact: "other"})
    assert trial.id != before


def test_a_row_has_every_column_and_every_figure_of_the_summary(small_trials):
    trial = small_trials[0]
    row = run_trial(trial).values()
    assert list(row) == list(COLUMNS)
    assert (row["error"], row["log"]) == (None, None)
    scenario = replace(scene.loads(trial.cell.document), seed=trial.seed)
    summary = flatten(Episode(scenario).run().summary)
    assert set(summary) - set(row) == NOT_IN_A_ROW
    timed = {name for name in summary if name.startswith("compute_ms")} | {"real_time_factor", "log", "schema"}
    assert {name: row[name] for name in summary if name not in {*timed, "scene"}} == {
        name: value for name, value in summary.items() if name not in {*timed, "scene"}
    }
    assert float(row["wall_s"]) > 0.0
    assert row["ticks"] == 10


def test_figures_beside_the_summarys_are_there(small_trials):
    row: dict[str, Any] = dict(run_trial(small_trials[0]).figures)
    assert set(row) == set(FIGURES)
    assert row["infeasible_ticks"] == row["ticks_without_nominal"] + row["ticks_without_own"]
    for name in ("time_to_avoid_s", "robot_skew", "robot_kurtosis", "people_skew", "people_kurtosis"):
        assert isinstance(row[name], float)
    assert row["min_lane_clearance_m"] is None


def test_the_detour_of_people_is_in_the_row_where_the_study_asks_for_it(small_trials):
    asked = replace(small_trials[0], detour=True)
    assert asked.id == small_trials[0].id  # it is the same episode
    without, found = (run_trial(trial).figures for trial in (small_trials[0], asked))
    assert without["detour_displacement_m"] is None
    assert found["detour_displacement_m"] == pytest.approx(0.0, abs=1e-9)  # nobody sees the robot, or meets it
    assert found["state_hash"] == without["state_hash"]


def test_values_fit_their_columns(small_trials):
    schema = pa.schema([(name, pa.type_for_alias(column.type)) for name, column in COLUMNS.items()])
    rows = [row.values() for row in (run_trial(small_trials[0]), failed_row(small_trials[1], "why"))]
    table = pa.Table.from_pylist(rows, schema=schema)
    assert table.to_pylist() == rows


def test_an_episode_is_a_function_of_its_trial(small_trials, serial_hashes):
    assert [run_trial(trial).figures["state_hash"] for trial in small_trials[:4]] == [
        serial_hashes[trial.id] for trial in small_trials[:4]
    ]
    assert len(set(serial_hashes.values())) == len(small_trials)


def test_a_broken_episode_is_a_row_with_its_cause_in_a_line(small_trials):
    trial = replace(small_trials[0], cell=replace(small_trials[0].cell, document="schema = 2"))
    row = run_trial(trial)
    assert row.error == "scenario.toml: schema: found 2; allowed: 1"
    assert row.figures == {}
    assert (row.id, row.seed, row.method) == (trial.id, trial.seed, trial.cell.method)


def test_a_broken_controller_is_told_by_its_cause_wherever_in_the_run_it_breaks(small_trials, monkeypatch):
    def decide(self, observation):
        raise ZeroDivisionError("by\n zero")

    run_trial(small_trials[0])  # warm
    monkeypatch.setattr("mjnav.control.base.GridController.decide", decide)
    assert run_trial(small_trials[0]).error.startswith(f"ZeroDivisionError: by zero ({__file__}:")


def test_every_method_meets_the_same_layout_under_a_seed_and_the_row_repeats_it():
    study = StudyFile(1, "layouts", ("rooms",), (MethodEntry("rkhs"), MethodEntry("mean")))
    cells = resolve(study, ["layout.purpose=training", "time_limit=1"])
    layouts = [
        [replace(prepared(Trial("layouts", cell, seed)), control=Control()) for cell in cells] for seed in (3, 4)
    ]
    assert all(one == other for one, other in layouts)
    assert layouts[0][0].people != layouts[1][0].people
    again = scene.loads(cells[0].document, seed=3)
    assert (again.layout, again.people) == (Layout(3, "training"), layouts[0][0].people)
