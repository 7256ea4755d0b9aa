"""`mjnav replay`: what it prints, and its exit codes."""

import json
import sys

import pytest

from mjnav.scene import loads

SHORT = ("--set", "time_limit=0.5", "--controller", "mean")


@pytest.fixture
def log(mjnav, tmp_path):
    assert mjnav("run", "crossing1", "--log", "a.mcap", *SHORT).code == 0
    return tmp_path / "a.mcap"


def test_a_run_that_is_the_same_again_is_one_line(mjnav, log):
    state_hash = json.loads(mjnav("inspect", log, "--json").out)["result"]["state_hash"]
    said = mjnav("replay", log)
    assert (said.code, said.out, said.err) == (0, f"identical: 5 ticks, state hash {state_hash}\n", "")


def test_one_that_is_not_says_where_it_begins_and_exits_with_1(mjnav, log, monkeypatch):
    other = 'noise.pose.x={distribution="gaussian", std=0.08}'
    # of the scenario in a log
    monkeypatch.setattr("mjnav.log.read.log.loads", lambda text, **known: loads(text, [other], **known))
    said = mjnav("replay", log)
    first, second, *_ = said.out.splitlines()
    assert said.code == 1
    assert first.startswith("differs in tick 0, at 0 s: ")
    assert first.endswith(" values, reading, estimate, decision")
    assert second.startswith("  reading   /odometry pose.0: ")
    assert " in the log, " in second
    assert second.endswith(" apart")
    printed = json.loads(mjnav("replay", log, "--json").out)
    assert (printed["identical"], printed["ticks"], printed["outcome"]) == (False, 1, "timeout")
    found = printed["first_difference"]
    assert (found["tick"], found["time_s"], found["part"], found["field"]) == (0, 0.0, "reading", "/odometry pose.0")
    assert found["amount"] == pytest.approx(abs(found["log"] - found["replay"]))
    assert printed["differences"] > 3


def test_a_log_without_its_end_is_said_to_be_one(mjnav, log):
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    said = mjnav("replay", log)
    assert said.code == 0
    assert said.out.startswith("identical as far as the log goes: ")


def test_a_controller_that_is_not_here_is_an_input_error_with_its_name(mjnav, tmp_path):
    (tmp_path / "gone_for_replay.py").write_text("from mjnav.control.methods.mean import Mean\nclass Own(Mean): pass\n")
    words = ("--controller", "gone_for_replay:Own", "--set", "time_limit=0.2")
    assert mjnav("run", "crossing1", "--log", "b.mcap", *words).code == 0
    assert mjnav("replay", "b.mcap", "--trust").code == 0
    assert mjnav("replay", "b.mcap", "--controller", "gone_for_replay:Own").code == 0
    refused = mjnav("replay", "b.mcap")
    assert (refused.code, len(refused.err.splitlines())) == (2, 1)
    (tmp_path / "gone_for_replay.py").unlink()
    del sys.modules["gone_for_replay"]
    said = mjnav("replay", "b.mcap", "--trust")
    assert (said.code, said.out) == (2, "")
    assert "gone_for_replay:Own" in said.err
