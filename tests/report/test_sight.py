"""Every table that compares methods says whether its people see the robot, and how many layouts it has."""

import csv
import io

import pytest
from rich.console import Console

from mjnav.report.comparison import before_after as before_after_text
from mjnav.report.comparison import before_after as before_after_tidy
from mjnav.report.comparison.html import html
from mjnav.report.comparison.latex import latex
from mjnav.report.comparison.notes import sight
from mjnav.report.comparison.text import write
from mjnav.report.comparison.tidy import csv_text, document
from mjnav.study.compare.before_after import before_after
from mjnav.study.compare.study_comparison import compare_study
from mjnav.study.store.store import Store
from tests.study.made_up import row

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")


def made(folder, cost=1.0):
    """One scene in which nobody sees the robot, one in which all do, one without people; the first draws 2 layouts."""
    store = Store(folder)
    sights = {"blind": "none", "seeing": "all", "empty": None}
    with store.writing(""):
        store.append(
            [row("rkhs", seed, cost + seed, scene=scene, people_see_robot=see,
                 layout=f"reporting {seed // 2}" if scene == "blind" else None)
             for scene, see in sights.items() for seed in range(4)]
        )  # fmt: skip
    return store


def printed(draw, found):
    file = io.StringIO()
    draw(found, Console(width=200, highlight=False, markup=False, emoji=False, file=file))
    return file.getvalue()


def test_in_text_page_latex_csv_and_json(tmp_path):
    results = compare_study(made(tmp_path), None, figures=["time_s"])
    lines = printed(write, results).splitlines()
    for heading in (
        "blind, default; 2 layouts; people do not see the robot; reference rkhs",
        "seeing, default; one layout; people see the robot; reference rkhs",
        "empty, default; one layout; reference rkhs",
    ):
        assert heading in lines
    assert "<small>2 layouts; people do not see the robot; differences from rkhs</small>" in html(results)
    assert r"\caption{seeing, default; one layout; people see the robot: rates" in latex(results)
    rows = list(csv.DictReader(io.StringIO(csv_text(results))))
    assert {(one["scene"], one["people_see_robot"]) for one in rows} == {
        ("blind", "none"), ("seeing", "all"), ("empty", "")
    }  # fmt: skip
    assert {(one["scene"], one["layouts"]) for one in rows} == {("blind", "2"), ("seeing", "1"), ("empty", "1")}
    assert {one["unit"] for one in rows if one["figure"] == "time_s"} == {"s"}
    assert [table["people_see_robot"] for table in document(results)["tables"]] == ["none", None, "all"]
    assert [table["layouts"] for table in document(results)["tables"]] == [2, 1, 1]


def test_before_and_after(tmp_path):
    found = before_after(made(tmp_path / "a"), made(tmp_path / "b", 2.0), figures=["time_s"])
    assert "blind, default, rkhs: 4 pairs; people do not see the robot" in printed(before_after_text.write, found)
    seen = {one["scene"]: one["people_see_robot"] for one in before_after_tidy.document(found)["cells"]}
    assert seen == {"blind": "none", "seeing": "all", "empty": None}
    rows = list(csv.DictReader(io.StringIO(before_after_tidy.csv_text(found))))
    assert {one["people_see_robot"] for one in rows if one["scene"] == "seeing"} == {"all"}


def test_in_words():
    assert sight(["3 of 5"]) == "3 of 5 people see the robot"
    assert (
        sight(["1 of 5", "2 of 5", "3 of 4", "none"])
        == "people see the robot by seed: 1 of 5, 2 of 5, 3 of 4 and 1 more"
    )
    assert sight([]) == ""
