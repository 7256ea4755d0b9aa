"""`mjnav paper`, from real episodes to the page."""

import json
from dataclasses import replace

import pytest

from mjnav.paper import episodes
from mjnav.study.study_file import load_study

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")


def test_an_item_is_run_drawn_and_judged_and_nothing_is_run_twice(mjnav, tmp_path, monkeypatch):
    study = load_study("paper-table")
    short = replace(study, set={**study.set, "time_limit": 0.5})
    monkeypatch.setattr(episodes, "load_study", {"paper-table": short}.__getitem__)
    said = mjnav("paper", "--only", "table", "--seeds", 1, "-o", "out", "--workers", 1)
    assert (said.code, said.err) == (0, "")
    lines = said.out.splitlines()
    assert lines[0] == "24 cells, 24 episodes"
    assert lines[-1] == "out/index.html"
    findings = json.loads((tmp_path / "out/table/findings.json").read_text())
    assert findings["episodes"] == 24
    assert {finding["verdict"] for finding in findings["findings"]} == {"not decided"}  # of one seed
    assert "goes around in most runs" in (tmp_path / "out/index.html").read_text()
    again = mjnav("paper", "--only", "table", "--seeds", 1, "-o", "out", "--workers", 1)
    assert again.out.splitlines()[:2] == ["24 cells, 24 episodes", "24 of them are done"]


def test_a_page_can_be_drawn_of_nothing(mjnav, tmp_path):
    said = mjnav("paper", "--only", "lane", "--draw", "-o", "out")
    assert (said.code, said.err) == (0, "mjnav: lane: no episode was run yet\n")
    assert "Not run: " in (tmp_path / "out/index.html").read_text()


def test_a_file_in_the_place_of_the_folder_is_refused_before_anything_is_drawn(mjnav, tmp_path):
    (tmp_path / "out").write_text("mine")
    said = mjnav("paper", "--only", "lane", "--draw", "-o", "out")
    assert (said.code, said.err) == (2, "mjnav: out: found a file; allowed: a folder for results, or none yet\n")
