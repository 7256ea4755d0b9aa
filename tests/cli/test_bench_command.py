"""`mjnav bench`: a controller of one's own beside the shipped rows, files, resumption, and what it refuses."""

import json
import shlex

import pytest

pytest.importorskip("pyarrow", reason="the sweep extra is not installed")

PARKED = """
from mjnav.messages import Decision, Status

class Parked:
    def __init__(self, limits, period, parameters):
        pass

    def decide(self, observation):
        return Decision(0.0, 0.0, Status.STOPPED)
"""
QUICK = ("bench", "parked.py:Parked", "--suite", "dsrnn", "--share", "0.015", "--workers", "1")


def test_a_method_of_ones_own_is_put_beside_all_others(mjnav, tmp_path):
    (tmp_path / "parked.py").write_text(PARKED)
    said = mjnav(*QUICK, "-o", "b.html", "-o", "b.svg", "-o", "b.tex")
    assert said.code == 0, said.err
    lines = said.out.splitlines()
    assert lines[0].startswith("dsrnn, version 1; ")
    assert lines[0].endswith("all differ from Parked")
    assert lines[2].split()[:3] == ["Parked", "2", "0"]
    assert any(line.split()[:2] == ["rkhs-plan", "2"] for line in lines)
    assert any("in dsrnn, worst: dsrnn, seed" in line for line in lines)
    assert "<svg" in (tmp_path / "b.svg").read_text()
    assert "rkhs-plan" in (tmp_path / "b.html").read_text()
    assert r"\toprule" in (tmp_path / "b.tex").read_text()

    again = mjnav(*QUICK, "--json")
    assert again.code == 0
    table = json.loads(again.out)["tables"][0]
    assert [row["episodes"] for row in table["methods"]][:2] == [2, 2]


def test_values_that_are_no_parameter_and_no_share_are_refused(mjnav):
    said = mjnav("bench", "rkhs", "--set", "robot.max_speed=3")
    assert (said.code, "robot.max_speed" in said.err) == (2, True)
    for share in ("0", "1.5", "nan"):
        said = mjnav("bench", "rkhs", "--share", share)
        assert (said.code, "--share" in said.err) == (2, True)
    said = mjnav("bench", "--suite", "room")
    assert (said.code, "did you mean 'rooms'?" in said.err) == (2, True)
    said = mjnav("bench", "rkhs", "--reference")
    assert (said.code, "--reference runs all" in said.err) == (2, True)


@pytest.mark.parametrize(
    ("option", "needed"),
    [
        ("--set weight=3", "METHOD"),
        *((option, "METHOD or --reference") for option in ("--quick", "--share 1", "--workers 1", "--max-seconds 9")),
    ],
)
def test_an_option_of_episodes_is_refused_where_none_is_run(mjnav, option, needed):
    said = mjnav("bench", *option.split())
    assert (said.code, said.err) == (2, f"mjnav: {option.split()[0]} needs {needed}\n")


OWN = """
schema = 1
[set]
physics.engine = "kinematic"
time_limit = 1.0
[[suites]]
name = "mine"
version = 3
description = "a scene of my own"
scenes = ["./corner.toml"]
seeds = { first = 7, count = 2 }
[[methods]]
controller = "mean"
"""
CORNER = """
schema = 1
name = "corner"
[robot]
start = [0.0, 0.0, 0.0]
goal = [4.0, 0.0]
"""


def test_suites_of_ones_own_get_rows_of_their_own(mjnav, tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/own.toml").write_text(OWN)
    (tmp_path / "mine/corner.toml").write_text(CORNER)
    (tmp_path / "parked.py").write_text(PARKED)
    made = mjnav("bench", "--suites", "mine/own.toml", "--reference", "--folder", "rows", "--workers", "1")
    assert made.code == 0, made.err
    assert (tmp_path / "mine/own.parquet").is_file()
    said = mjnav("bench", "parked.py:Parked", "--suites", "mine/own.toml", "--workers", "1", "--json")
    assert said.code == 0, said.err
    (table,) = json.loads(said.out)["tables"]
    assert [(row["method"], row["episodes"]) for row in table["methods"]] == [("parked.py:Parked", 2), ("mean", 2)]

    (tmp_path / "mine/own.toml").write_text(OWN.replace("version = 3", "version = 4"))
    said = mjnav("bench", "parked.py:Parked", "--suites", "mine/own.toml", "--workers", "1")
    again = next(line for line in said.out.splitlines() if line.startswith("    mjnav run mine/corner.toml "))
    assert json.loads(mjnav(*shlex.split(again.partition(";")[0])[1:], "--json").out)["outcome"] == "timeout"
    assert "suite mine: the reference rows are of version 3, this is 4" in said.err
