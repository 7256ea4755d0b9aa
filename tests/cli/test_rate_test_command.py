"""`mjnav rate-test`: what it prints, how it ends and what it refuses."""

import json
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from mjnav.log import open_log

pytestmark = pytest.mark.xdist_group("real time")

PATIENCE = 60.0  # [s] for a process to get as far as its first tick on a busy machine
TINY = ("--controller", "mean", "--set", "physics.engine=kinematic")
DOCUMENTED = """
    schema scene requested_hz achieved_hz real_time_factor ticks deadline_misses longest_overrun_ms wakeup_us compute_ms
    log_dropped scheduler status
"""
MORE = """
    controller timestep_ms skipped_periods longest_overrun lateness_us page_faults stolen memory affinity load
    load_average kernel cpus state_hash misses_by_cause missed machine_gaps
"""


@pytest.fixture
def own_machine(monkeypatch):
    """No other virtual machine takes processor time, or a FAIL could be INCONCLUSIVE."""
    monkeypatch.setattr("mjnav.loop.realtime.rate_test._processor_time", lambda: np.zeros(2))


def test_json_is_one_object_with_the_documented_keys_and_more(mjnav):
    said = mjnav("rate-test", "crossing1", "--rate", "20", "--duration", "0.2", "--json", *TINY)
    assert said.code == 0
    printed = json.loads(said.out, parse_constant=pytest.fail)
    assert sorted(printed) == sorted(f"{DOCUMENTED} {MORE}".split())
    assert (printed["scene"], printed["controller"], printed["requested_hz"]) == ("crossing1", "mean", 20.0)
    assert (printed["ticks"], printed["status"]) == (4, "INCONCLUSIVE")
    assert list(printed["wakeup_us"]) == ["p50", "p99", "p999", "max"]
    assert list(printed["compute_ms"]) == ["sense", "estimate", "control", "record", "tick"]
    assert printed["load"] == "none"
    assert printed["cpus"] >= 1
    assert re.fullmatch("[0-9a-f]{64}", printed["state_hash"])


def test_for_people_it_gives_a_verdict_with_its_rules_and_a_histogram(mjnav, tmp_path):
    said = mjnav("rate-test", "crossing1", "--rate", "20", "--duration", "0.2", *TINY)
    assert (said.code, said.err) == (0, "")
    assert said.out.startswith("crossing1, mean: INCONCLUSIVE at 20 Hz\n")
    for word in (
        "achieved",
        "missed",
        "overrun",
        "wake-up",
        "dropped",
        "SCHED_",
        "its gaps",
        "load",
        "page faults",
        "compute",
    ):
        assert word in said.out
    assert "INCONCLUSIVE, by the first of these that holds:" in said.out
    assert len(re.findall("^    (?:PASS|DEGRADED|FAIL|INCONCLUSIVE) ", said.out, re.MULTILINE)) == 5
    histograms = said.out.partition("behind their deadline [µs]")[2].partition("work of ticks")
    assert [sum(map(int, re.findall(r"  +(\d+)  █", part))) for part in (histograms[0], histograms[2])] == [4, 4]
    assert list(tmp_path.iterdir()) == []  # the log was a temporary one


@pytest.mark.usefixtures("own_machine")
def test_a_rate_that_cannot_be_kept_fails_with_exit_1(mjnav):
    said = mjnav("rate-test", "crossing1", "--rate", "1000", "--duration", "0.3", "--samples", "150", "--json")
    printed = json.loads(said.out)
    assert (said.code, printed["status"], printed["ticks"]) == (1, "FAIL", 300)
    assert printed["deadline_misses"] > 3
    assert printed["longest_overrun_ms"] > 0.0
    assert printed["longest_overrun"]["phase"] in (
        "wake-up", "sense", "estimate", "control", "record", "advance", "rest"
    )  # fmt: skip
    assert printed["achieved_hz"] < 1000.0


# --------------------------------------------------------------------------------------------- sweeps


def test_a_sweep_is_a_line_for_each_rate_in_order_and_the_highest_that_passes(mjnav):
    said = mjnav("rate-test", "crossing1", "--sweep", "20,10", "--duration", "0.2", *TINY)
    assert said.code == 0  # nothing failed
    first, second, last = said.out.splitlines()
    assert re.match(r" +10 Hz: INCONCLUSIVE +\d of 2 missed, longest overrun .* of the period$", first)
    assert re.match(r" +20 Hz: INCONCLUSIVE +\d of 4 missed, ", second)
    assert last == "no rate passes"


def test_a_sweep_may_go_over_people_and_samples_too(mjnav):
    words = ("--sweep", "20", "--people", "0,2", "--samples", "9,16", "--duration", "0.1")
    printed = json.loads(mjnav("rate-test", "crossing1", *words, "--json", *TINY).out)
    cases = [(0, 9), (0, 16), (2, 9), (2, 16)]
    assert [(test["people"], test["samples"]) for test in printed["tests"]] == cases
    assert printed["highest_passing_hz"] == [
        {"people": people, "samples": samples, "hz": None} for people, samples in cases
    ]
    words = ("--sweep", "20", "--people", "0,2", "--samples", "9", "--duration", "0.1")
    lines = mjnav("rate-test", "crossing1", *words, *TINY).out.splitlines()
    assert len(lines) == 4
    assert lines[0].startswith("    20 Hz, 0 people, 9 samples: ")
    assert lines[-1] == "with 2 people and 9 samples: no rate passes"


def test_one_number_of_people_is_one_test(mjnav):
    words = ("--rate", "20", "--people", "3", "--duration", "0.1", "--log", "a.mcap")
    assert json.loads(mjnav("rate-test", "crossing1", *words, "--json", *TINY).out)["ticks"] == 2
    assert len(open_log("a.mcap").scenario().people) == 3


# ----------------------------------------------------------------------------------- log and interrupt


def test_an_interrupted_test_reports_what_was_done_and_keeps_its_log(mjnav, start, tmp_path):
    path = tmp_path / "a.mcap"
    process = start("rate-test", "crossing1", "--duration", "600", "--json", "--log", path, *TINY)
    ends = time.monotonic() + PATIENCE
    while not (path.exists() and path.stat().st_size > 40_000):
        assert time.monotonic() < ends, "the test did not begin"
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "mjnav: interrupted"
    assert "Traceback" not in err
    printed = json.loads(out)
    assert (printed["status"], printed["requested_hz"]) == ("INCONCLUSIVE", 50.0)
    said = mjnav("inspect", path, "--json")
    found = json.loads(said.out)
    assert (said.code, found["complete"], found["outcome"]) == (0, True, "aborted")
    assert found["result"]["ticks"] == printed["ticks"] > 0
    assert found["result"]["state_hash"] == printed["state_hash"]


# ------------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["--rate", "0"], "rate: found 0.0; allowed: a number from 0.1 to 1000 Hz"),
        (["--rate", "fast"], "--rate: invalid float value: 'fast'"),
        (["--rate", "33.3333"], "a rate with a time step in common with sensors.rate (10 Hz)"),
        (["--duration", "0"], "duration: found 0.0; allowed: a number > 0"),
        (["--sweep", ""], "--sweep: found ''; allowed: numbers with commas between them"),
        (["--sweep", "10,-20"], "rate: found -20.0"),
        (["--rate", "10", "--sweep", "10"], "not allowed with argument"),
        (["--people", "1.5"], "--people: found '1.5'; allowed: whole numbers with commas between them"),
        (["--samples", "0"], "control.samples: found 0"),
        (["--log", "a.mcap", "--sweep", "10,20"], "--log needs a single test"),
        (["--log", "/dev/null"], "/dev/null: exists already"),
        (["--set", "robot.goal_tolerance=9.0"], "robot.goal: found (10.0, 0.0); allowed: a way to drive"),
    ],
)
def test_what_cannot_be_used_is_refused_before_anything_starts(mjnav, tmp_path, monkeypatch, words, fragment):
    monkeypatch.setattr("mjnav.cli.rate_test.warm_up", pytest.fail)
    said = mjnav("rate-test", "crossing1", *words)
    assert (said.code, said.out) == (2, "")
    assert said.err.startswith("mjnav: ")
    assert fragment in said.err
    assert "Traceback" not in said.err
    assert list(Path(tmp_path).iterdir()) == []
