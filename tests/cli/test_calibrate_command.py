"""`mjnav calibrate`: what it prints, what it draws and what it refuses."""

import json
import pickle
import signal

import pytest

from mjnav import scene
from mjnav.study.calibration import SETTINGS

SHORT = ("--set", "time_limit=1.0", "--set", "physics.engine=kinematic", "--draws", "100", "--seeds", "2")


def test_every_method_and_setting_has_a_row_and_a_curve_and_the_picture_is_drawn(mjnav, tmp_path):
    said = mjnav("calibrate", "crossing1", "--controller", "rkhs", "mean", *SHORT, "-o", "curve.png")
    assert said.code == 0
    lines = said.out.splitlines()
    assert lines[-1] == "curve.png"
    assert (tmp_path / "curve.png").read_bytes().startswith(b"\x89PNG")
    assert lines[0] == "crossing1, seeds 0 to 1, every 5 ticks, 100 draws"
    assert [tuple(line.split()[:3]) for line in lines[4:10]] == [
        (setting, method, "4") for setting in SETTINGS for method in ("rkhs", "mean")
    ]
    curves = [line.split() for line in lines[12:-2]]
    for method in ("rkhs", "mean"):
        for setting in SETTINGS:
            assert sum(int(row[2]) for row in curves if row[:2] == [setting, method]) == 4


def test_json_is_one_object_and_nothing_else_and_one_seed_has_no_intervals(mjnav):
    words = ("calibrate", "crossing1", "--json", "--first", "7", "--every", "3", *SHORT)
    printed = json.loads(mjnav(*words).out, parse_constant=pytest.fail)
    assert (printed["schema"], printed["scene"], printed["seeds"]) == (1, "crossing1", [7, 8])
    assert (printed["every"], printed["draws"], printed["picture"]) == (3, 100, None)
    assert printed["event"] == {"form": "segment", "horizon_s": 5.0, "preview_s": 0.4, "margin_m": 0.0}
    assert tuple(printed["methods"]["rkhs"]) == SETTINGS
    direct = printed["methods"]["rkhs"]["direct"]
    assert (direct["count"], direct["num_groups"], sum(b["count"] for b in direct["bins"])) == (6, 2, 6)
    alone = json.loads(mjnav(*words, "--seeds", "1").out)["methods"]["rkhs"]["direct"]
    assert (alone["count"], alone["bias_interval"], alone["ece_interval"]) == (3, None, None)


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["hal"], "did you mean 'hall'?"),
        (["hall", "--seeds", "0"], "mjnav: --seeds: found 0; allowed: a whole number >= 1"),
        (["hall", "--first", str(2**63 - 1)], "mjnav: --first: found 9223372036854775807; allowed:"),
        (["hall", "-o", "curve.pdf"], "mjnav: --output: found 'curve.pdf'; allowed: a file name that ends in .png"),
    ],
)
def test_bad_input_is_refused_before_anything_starts(mjnav, monkeypatch, words, line):
    monkeypatch.setattr("mjnav.cli.calibrate.warm_up", pytest.fail)
    said = mjnav("calibrate", *words)
    assert (said.code, said.out) == (2, "")
    assert line in said.err
    assert "Traceback" not in said.err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_is_one_line(mjnav, monkeypatch, number):
    before = signal.getsignal(number)
    monkeypatch.setattr("mjnav.cli.calibrate.calibrate", lambda *_, **__: signal.raise_signal(number))
    said = mjnav("calibrate", "crossing1", *SHORT)
    assert (said.code, said.out, said.err) == (130, "", "mjnav: interrupted\n")
    assert signal.getsignal(number) is before


def test_a_scenario_can_be_sent_to_a_worker():
    scenario = scene.load("hall", ["noise.odometry.v={distribution='student_t', std=0.1, df=4.0}"])
    assert pickle.loads(pickle.dumps(scenario)) == scenario
