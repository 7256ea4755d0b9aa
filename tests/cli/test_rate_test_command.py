"""`mjnav rate-test`: what it prints and how it ends."""

import json
import re
import signal
import time

import numpy as np
import pytest

from mjnav.cli.rate_test import describe
from mjnav.log import open_log
from mjnav.metrics.timing import RULES

pytestmark = pytest.mark.xdist_group("real time")

PATIENCE = 60.0  # [s] for a process to get as far as its first tick on a busy machine
TINY = ("--controller", "mean", "--set", "physics.engine=kinematic")


def test_it_gives_a_verdict_with_what_it_counted_and_its_rules(mjnav, tmp_path):
    said = mjnav("rate-test", "crossing1", "--rate", "20", "--duration", "0.2", "--json", *TINY)
    summary = json.loads(said.out, parse_constant=pytest.fail)
    assert (said.code, summary["schema"], summary["ticks"], summary["status"]) == (0, 1, 4, "INCONCLUSIVE")
    assert re.fullmatch("[0-9a-f]{64}", summary["state_hash"])
    assert list(tmp_path.iterdir()) == []  # the log was a temporary one
    missed = {"tick": 2, "since": 1, "phase": "control", "cause": "machine", "milliseconds": 1.5}
    summary |= {"deadline_misses": 1, "misses_by_cause": {"loop": 0, "machine": 1}, "missed": [missed]}
    text = "\n".join(describe(summary))
    assert text.startswith("crossing1, mean: INCONCLUSIVE at 20 Hz\n")
    assert "  deadlines     1 of 4 missed (0 by the loop, 1 by the machine), " in text
    assert "    tick 2       1.50 ms over, control of tick 1: the machine\n" in text
    assert all(f"    {name:12}  {rule}\n" in text for name, rule in RULES)


def test_a_rate_that_cannot_be_kept_fails_with_exit_1(mjnav, monkeypatch):
    # no other virtual machine takes processor time, or a FAIL could be INCONCLUSIVE
    monkeypatch.setattr("mjnav.loop.realtime.rate_test._processor_time", lambda: np.zeros(2))
    words = ("--rate", "1000", "--duration", "0.3", "--set", "control.samples=150", "--json")
    said = mjnav("rate-test", "crossing1", *words)
    printed = json.loads(said.out)
    assert (said.code, printed["status"], printed["ticks"]) == (1, "FAIL", 300)
    assert printed["deadline_misses"] > 3
    assert printed["achieved_hz"] < 1000.0


def test_an_interrupted_test_reports_what_was_done_and_keeps_its_log(start, tmp_path):
    path = tmp_path / "a.mcap"
    process = start("rate-test", "crossing1", "--duration", "600", "--json", "--log", path, *TINY)
    ends = time.monotonic() + PATIENCE
    while not (path.exists() and path.stat().st_size > 40_000):
        assert time.monotonic() < ends, "the test did not begin"
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err.splitlines()[-1], "Traceback" in err) == (130, "mjnav: interrupted", False)
    printed, log = json.loads(out), open_log(path)
    assert (printed["status"], log.complete, log.result["outcome"]) == ("INCONCLUSIVE", True, "aborted")
    assert log.result["ticks"] == printed["ticks"] > 0
    assert log.result["state_hash"] == printed["state_hash"]
