"""An episode as a row, and the id that it is known by."""

from dataclasses import fields, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from mjnav import scene
from mjnav.loop.episode import Episode
from mjnav.loop.provenance import FACTS, provenance
from mjnav.messages import ObstacleSamples
from mjnav.scene.spec import Control, Layout
from mjnav.study.cells import Cell, resolve
from mjnav.study.store import COLUMNS
from mjnav.study.study_file import MethodEntry, StudyFile
from mjnav.study.trial import SampleShape, Trial, flatten, prepared, run_trial

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


def test_the_detour_of_people_is_in_the_row_where_the_study_asks_for_it(small_trials):
    asked = replace(small_trials[0], detour=True)
    assert asked.id == small_trials[0].id  # it is the same episode
    without, found = (run_trial(trial).figures for trial in (small_trials[0], asked))
    assert without["detour_displacement_m"] is None
    assert found["detour_displacement_m"] == pytest.approx(0.0, abs=1e-9)  # nobody sees the robot, or meets it
    assert found["state_hash"] == without["state_hash"]


def test_a_broken_episode_is_a_row_with_its_cause_in_a_line(small_trials):
    trial = replace(small_trials[0], cell=replace(small_trials[0].cell, document="schema = 2"))
    row = run_trial(trial)
    assert row.error == "scenario.toml: schema: found 2; allowed: 1"
    assert row.figures == {}
    assert (row.id, row.seed, row.method) == (trial.id, trial.seed, trial.cell.method)


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


# ---------------------------------------------------------------------------------- shape of the samples


def record(robot, *people, num_discs=0):
    """What of a tick the shape looks at; the discs come after the people."""
    discs = [*people, *[np.zeros((1, 2))] * num_discs]
    return SimpleNamespace(
        seen=SimpleNamespace(
            robot_pose=np.column_stack([robot, np.zeros(len(robot))]),
            obstacles=tuple(ObstacleSamples(disc, np.zeros_like(disc), 0.3) for disc in discs),
        ),
        tracks=people,
        cone=None,
    )


def shape_of(records):
    shape = SampleShape()
    for one in records:
        shape(one)
    return shape.figures()


def test_skew_and_kurtosis_are_scipys_unbiased_ones_over_ticks_axes_and_people():
    rng = np.random.default_rng(0)
    samples = rng.gamma(2.0, size=(6, 3, 25, 2))
    found = shape_of([record(robot, *people, num_discs=2) for robot, *people in samples])
    for name, of_kind in (("robot", samples[:, 0]), ("people", samples[:, 1:])):
        axis = of_kind.ndim - 2
        assert found[f"{name}_skew"] == pytest.approx(stats.skew(of_kind, axis=axis, bias=False).mean())
        kurtosis = stats.kurtosis(of_kind, axis=axis, bias=False, fisher=False).mean()
        assert found[f"{name}_kurtosis"] == pytest.approx(kurtosis)


def test_what_has_no_shape_is_none():
    known, few = shape_of([record(np.ones((25, 2)))]), shape_of([record(np.eye(3)[:, :2])])
    assert known["robot_skew"] is known["robot_kurtosis"] is known["people_skew"] is None
    assert few["robot_skew"] is few["robot_kurtosis"] is None
    assert shape_of([])["robot_skew"] is None
