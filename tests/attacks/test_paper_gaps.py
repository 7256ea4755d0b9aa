"""`mjnav paper --draw` on what an interruption leaves: other seeds a cell, absent cells, failed episodes.

Every figure depends on the seed far more than on the method, so that rows paired by their place give the wrong sign.
"""

import json
import random
import re
import subprocess
import sys
from dataclasses import asdict
from html.parser import HTMLParser

import pytest

from mjnav.paper import load
from mjnav.paper.claims import Verdict, judge
from mjnav.paper.episodes import rows, studies
from mjnav.study.store.row import FIGURES
from mjnav.study.store.store import Store
from mjnav.study.trial import Trial
from tests.study.made_up import labelled_row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

DRAWN = ("lane", "table")  # by the command; `one` is judged from its rows, as its figure takes long
HIGH = ("d=3", "rkhs d=3", "gaussian-moments eta=0.99")  # 0.2 below the others, seed by seed, and run on later seeds
ALONE = ("d=3 matched", "gaussian-moments eta=0.7")  # one seed in common with the others
FAILED = ("d=2",)  # without any result
FARTHER = "stays farther from the lane's boundary than degree 1"
ABSENT = ("d=2 matched", "rkhs d=2")


def row_of(trial, value):
    """A row whose figures are all `value`; without it, a failed one."""
    cell = trial.cell
    place = (cell.scene, cell.setting, cell.method, trial.seed)
    labels = {"id": trial.id, "study": trial.study, "scenario": cell.document}
    if value is None:
        return labelled_row(*place, {}, **labels, error="the battery is empty")
    numbers = {name: value for name, column in FIGURES.items() if column.type == "double"}
    counts = {name: 0 for name, column in FIGURES.items() if column.type == "int64"}
    ticks = {"ticks": 10_000, "ticks_without_own": round(100 * value), "infeasible_ticks": round(100 * value)}
    return labelled_row(*place, {**numbers, **counts, **ticks, "success": True}, **labels)


def rows_of(wanted):
    """What is left of the studies: at most sixty seeds a cell, in no order."""
    for study in wanted:
        for i, cell in enumerate(study.cells):
            if cell.method in ABSENT:
                continue
            first = 59 if cell.method in ALONE else 20 if cell.method in HIGH else 0
            for seed in range(first, first + 60):
                value = None if cell.method in FAILED or seed % 13 == 0 else 1.0 + seed - 0.2 * (cell.method in HIGH)
                yield row_of(Trial(study.file.name, cell, seed), value and value + 1e-3 * ((seed + i) % 3))


class Text(HTMLParser):
    def __init__(self):
        super().__init__()
        self.text, self._style = "", False

    def handle_starttag(self, tag, attrs):
        self._style = tag == "style"

    def handle_data(self, data):
        self.text += "" if self._style else f"{data}\n"


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """The folder, what the command said, the findings by item and claim, the page's text."""
    folder = tmp_path_factory.mktemp("paper")
    wanted, store = studies(load(name) for name in (*DRAWN, "one")), Store(folder / "rows")
    left = list(rows_of(wanted))
    random.Random(0).shuffle(left)
    store.folder.mkdir(parents=True)
    store.append(left)
    words = [sys.executable, "-m", "mjnav.cli.main", "paper", "--draw", "--only", *DRAWN, "surface", "-o", str(folder)]
    said = subprocess.run(words, capture_output=True, text=True, check=False)
    findings = {"one": {f.claim: asdict(f) for f in judge(load("one").claims(rows(store, wanted[-1:])[0]))}}
    for name in DRAWN:
        document = json.loads((folder / name / "findings.json").read_text())
        findings[name] = {finding["claim"]: finding for finding in document["findings"]}
    text = Text()
    text.feed((folder / "index.html").read_text())
    return folder, said, findings, text.text


def test_it_is_drawn_without_a_word_of_python(drawn):
    folder, said, findings, text = drawn
    assert said.returncode == 0
    assert said.stderr == "mjnav: surface: not measured yet\n"
    assert re.findall(r"\b(?:nan|inf|None)\b", text) == []
    for claims in findings.values():
        assert {claim["verdict"] for claim in claims.values()} <= set(Verdict)
        assert [claim for claim, f in claims.items() if re.search(r"\b(?:nan|inf|None)\b", f["evidence"])] == []
    for name in DRAWN:
        assert (folder / name / "figure.png").stat().st_size > 10_000
        assert re.findall(r"\b(?:nan|inf|None)\b", (folder / name / "data.csv").read_text()) == []


def test_methods_are_paired_by_seed_and_never_by_their_place(drawn):
    _, _, findings, _ = drawn
    lane = findings["lane"][f"Degree 3 {FARTHER}, at one weight"]
    assert lane["verdict"] == Verdict.FAILS  # 20 later seeds by place: +20
    assert lane["evidence"].startswith("settings: 0 for it, 8 against, 0 open\nlane, ")
    assert all("m [-0.2" in line and "(n = 37)" in line for line in lane["evidence"].splitlines()[1:])
    (eta,) = (finding for claim, finding in findings["one"].items() if "the higher the eta" in claim)
    assert eta["verdict"] == Verdict.FAILS
    assert findings["one"]["rkhs d=3 takes less control cost than gaussian-linearised"]["verdict"] == Verdict.HOLDS


@pytest.mark.parametrize(
    ("item", "claim"),
    [
        ("lane", f"Degree 2 {FARTHER}, at one weight"),  # all failed
        ("lane", f"Degree 2 {FARTHER}, at matched weights of the mean's term"),  # absent
        ("lane", f"Degree 3 {FARTHER}, at matched weights of the mean's term"),  # no pair
        ("one", "rkhs d=1 takes less control cost than gaussian-moments eta=0.7"),
    ],
)
def test_too_few_pairs_leave_a_claim_open(drawn, item, claim):
    finding = drawn[2][item][claim]
    assert finding["verdict"] == Verdict.OPEN
    assert "too few to judge by" in finding["evidence"]


def test_failed_episodes_are_told_and_are_neither_successes_nor_misses(drawn):
    _, _, findings, text = drawn
    table = findings["table"]["Degree 3 goes around in most runs"]["evidence"]
    assert "of 55 runs, 0 more did not reach the goal unharmed, 5 episodes failed" in table
    nominal = findings["one"]["A nominal control always exists"]
    assert nominal["verdict"] == Verdict.HOLDS
    assert "100.0 % [93.5, 100.0] of 55 runs" in nominal["evidence"]
    assert re.search(r"\d+ of 8000 episodes were run\.\s+\d+ episodes failed and have no result\.", text)
    assert "8 cells were not run at all" in text
