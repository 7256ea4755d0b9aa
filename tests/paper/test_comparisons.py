"""Every item that is judged by studies: its verdicts on rows whose answers are known, and its picture of gaps."""

import re

import numpy as np
import pytest
from matplotlib.text import Text

from mjnav.paper import ITEMS, load, pareto
from mjnav.paper.claims import StudyItem, Verdict, judge
from mjnav.paper.comparisons import LEVELS
from mjnav.paper.episodes import studies, trials
from mjnav.study.cells import variants
from mjnav.study.study_file import load_study

HOLDS, FAILS, OPEN = Verdict.HOLDS, Verdict.FAILS, Verdict.OPEN
SEEDS = np.arange(40)
STUDY_ITEMS = [name for name in ITEMS if isinstance(load(name), StudyItem)]
FARTHER, LARGER = "stays farther from the lane's boundary than", "keeps a larger distance from the obstacle than"
TIMED = "With 25 samples of robot and obstacles"
EQUAL = "At equal clearance, rkhs d=1 takes"
SHAPE = "saa gives less control cost with samples of the noise's own shape than with"


def columns(pattern: str, **columns):
    """These columns for every cell whose scene, setting and method match."""
    return lambda *place: columns if re.search(pattern, " | ".join(place)) else {}


def cost_of_factors(scene, setting, method):
    """1 less by the form, 0.5 by the prediction, 0.25 more where form and preview meet; methods 1 apart."""
    saved = 1.0 * ("form=segment" in setting) + 0.5 * ("prediction=true" in setting)
    saved += 0.25 * ("form=segment preview=0.4" in setting)
    return {"control_cost": 5.0 - saved + ("rkhs", "saa", "mean").index(method)}


def at_equal_clearance(scene, setting, method):
    """Curves of cost 10 x clearance, that of saa 2 higher."""
    clearance = float(method.rpartition("=")[2])
    return {
        "min_clearance_m": np.full(40, clearance),
        "control_cost": 10.0 * clearance + 2.0 * method.startswith("saa"),
    }


WAYS = columns("", max_deviation_m=np.where(SEEDS < 35, 0.3, 1.2))
LOST = columns("", success=np.where(SEEDS < 10, 0.0, 1.0))
MISSING = columns("", ticks_without_nominal=np.where(SEEDS == 3, 2.0, 0.0))
COSTLY = columns("crossing2.*gauss", control_cost=2.0)
MIRRORED = columns("mirrored.*saa", control_cost=2.0)
MOVING = columns("drives on.*reading d=2", mean_deviation_m=0.5)
ONCE = columns("crossing1.*drives on.*reading d=2", mean_deviation_m=0.5)
STRAIGHTER = "reading d=2 takes less deviation from the way than gau"
APART = columns("saa", min_clearance_m=np.full(40, 3.0))
FORM, PREVIEW = (f"{name} saves" for name in list(LEVELS)[:2])
# item, columns that are changed, the claim's beginning, its verdict, a part of the evidence
CASES = [
    ("degree", columns("d=3$", min_clearance_m=1.5), f"Degree 3 {LARGER} degree 1, at one", HOLDS, "8 for it"),
    ("degree", columns("d=3$", min_clearance_m=1.5), f"Degree 3 {LARGER} degree 1, at matched", OPEN, "0 for it"),
    ("lane", columns("d=3 m", mean_lane_clearance_m=0.5), f"Degree 3 {FARTHER} degree 1, at ma", FAILS, "-0.5 m"),
    ("table", WAYS, "Degree 1 goes between", HOLDS, "87.5 % [73.9, 94.5] of 40 runs, 0 more"),
    ("table", WAYS, "Degree 3 goes around", FAILS, "12.5 %"),
    ("table", LOST, "Degree 1, as heavy", FAILS, "of 30 runs, 10 more did not reach the goal unharmed"),
    ("one", columns("rkhs d=3", control_cost=0.5), "rkhs d=3 takes less control cost than gau", HOLDS, "-0.5"),
    ("one", columns("eta=0.99", ticks_without_own=19.8), "The moment surr", HOLDS, "+19.8 points"),
    ("one", MISSING, "A nominal control", FAILS, "97.5 % [87.1, 99.6] of 40 runs"),
    ("many", COSTLY, "With 2 obstacles, rkhs d=3 takes less control", HOLDS, "-1 m²/s³"),
    ("many", COSTLY, "With 1 obstacle, rkhs d=3 takes less control", OPEN, "0 for it"),
    ("reading", MOVING, f"Of a robot that drives on: {STRAIGHTER}", HOLDS, "3 for it"),
    ("reading", MOVING, f"Of a robot that may stop: {STRAIGHTER}", OPEN, "0 for it"),
    ("reading", ONCE, f"Of a robot that drives on: {STRAIGHTER}", Verdict.PARTLY, "1 for it, 0 against, 2 open"),
    ("shape", MIRRORED, f"{SHAPE} mirrored", HOLDS, "2 for it"),
    ("shape", MIRRORED, f"{SHAPE} gaussian", OPEN, "0 for it"),
    ("factors", cost_of_factors, FORM, HOLDS, "rkhs, kinematic: -1.12 m²/s³"),
    ("factors", cost_of_factors, PREVIEW, HOLDS, "mean, mujoco: -0.125 m²/s³"),
    ("factors", cost_of_factors, "Matching by a weight (rkhs) saves control, against c", HOLDS, "mujoco: -2 m²/s³"),
    ("pareto", at_equal_clearance, f"{EQUAL} less control than saa", HOLDS, "m: -2 m²/s³ [-2, -2] (n = 40)"),
    ("pareto", APART, f"{EQUAL} less control than saa", OPEN, "no clearance"),
    ("real_time", columns("=25", compute_ms_control_p99=150.0), f"{TIMED}, d=3", FAILS, "+50 ms"),
]


@pytest.fixture(autouse=True)
def fewer_resamples(monkeypatch):
    """As many as a p-value needs that survives the correction for the number of these claims."""
    monkeypatch.setattr(pareto, "RESAMPLES", 2000)


@pytest.mark.parametrize(("name", "change", "claim", "verdict", "evidence"), CASES)
def test_a_claim_is_judged_by_its_own_cells(cells_of, name, change, claim, verdict, evidence):
    findings = judge(load(name).claims(cells_of(load(name), change)))
    found = next(finding for finding in findings if finding.claim.startswith(claim))
    assert found.verdict == verdict
    assert evidence in found.evidence
    assert len({finding.claim for finding in findings}) == len(findings)


def gappy(cells):
    """Every third cell is missing, and the others have seeds of their own."""
    kept = [cell for i, cell in enumerate(cells) if i % 3]
    return [
        type(c)(c.scene, c.setting, c.method, {k: v[: 40 - i % 30] for k, v in c.columns.items()})
        for i, c in enumerate(kept)
    ]


def failed(cells):
    """No episode has a result."""
    nothing = np.full(40, np.nan)
    return [
        type(c)(c.scene, c.setting, c.method, {k: v if k == "seed" else nothing for k, v in c.columns.items()})
        for c in cells
    ]


@pytest.mark.parametrize(
    ("name", "left"), [*((name, gappy) for name in STUDY_ITEMS), *((name, failed) for name in ("one", "pareto"))]
)
def test_every_item_is_judged_and_drawn_whatever_is_left(cells_of, name, left):
    item, cells = load(name), left(cells_of(load(name)))
    findings = judge(item.claims(cells))
    if left is failed:
        assert {finding.verdict for finding in findings} == {OPEN}
    words = [text.get_text() for text in item.picture(cells).findobj(Text)]
    for text in (*words, *(finding.evidence for finding in findings)):
        assert not re.search(r"\b(?:nan|inf|None)\b", text)
    assert ("undefined" in words) == (left is failed and name != "pareto")
    assert ("not run" in words) == (left is gappy and name != "pareto")


def test_the_episodes_of_all_items_take_turns_seed_by_seed():
    wanted = studies([load("lane"), load("table")], 3)
    every = trials(wanted)
    assert len({trial.id for trial in every}) == len(every) == 3 * sum(len(study.cells) for study in wanted)
    assert [trial.seed for trial in every] == sorted(trial.seed for trial in every)


def test_a_study_that_two_items_share_is_run_once():
    assert [study.file.name for study in studies(map(load, ("one", "many")), 1)] == ["paper-one", "paper-many"]


def test_methods_are_tuned_on_other_seeds_among_the_values_of_the_pareto_study():
    tuning, pareto = load_study("paper-tuning"), load_study("paper-pareto")
    assert min(tuning.all_seeds) > max(pareto.all_seeds)
    first, second = ({v.names: v.overrides for v in variants(study, ["crossing3"])} for study in (tuning, pareto))
    assert first == second
    swept = {method.identifier: method.grid for method in pareto.methods}
    for name in ("paper-one", "paper-many", "paper-shape"):
        for method in load_study(name).methods:
            if not method.grid:
                ((key, values),) = swept[method.identifier].items()
                assert method.set[key] in list(values)
