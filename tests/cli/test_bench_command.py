"""`mjnav bench`: a controller of one's own beside the shipped rows, files, resumption, and what it refuses."""

import json

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
QUICK = ("bench", "parked.py:Parked", "--suite", "dsrnn", "--share", "0.05", "--workers", "1")


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
