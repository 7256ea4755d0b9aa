"""A run that is interrupted ends its log in order."""

import json
import signal
import time

import pytest

from mjnav.recording import open_log

PATIENCE = 60.0  # [s] for a process to get as far as its first tick on a busy machine
LONG = ("--set", "time_limit=600", "--set", "robot.goal_tolerance=0.001", "--set", "stop_on_collision=false")


def wait_for(path) -> None:
    """Until the log is there with a little more than its beginning."""
    ends = time.monotonic() + PATIENCE
    while not (path.exists() and path.stat().st_size > 40_000):
        assert time.monotonic() < ends, "the run did not begin"
        time.sleep(0.02)


def test_the_first_signal_ends_the_run_and_its_log_in_order(start, tmp_path):
    runs = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        path = tmp_path / f"{number.name}.mcap"
        runs[number] = start("run", "crossing1", "--real-time", "--json", "--log", path, *LONG), path
    for number, (process, path) in runs.items():
        wait_for(path)
        process.send_signal(number)
    for process, path in runs.values():
        out, err = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert err.splitlines()[-1] == "mjnav: interrupted"
        assert "Traceback" not in err
        printed = json.loads(out)
        log = open_log(path)
        assert (log.complete, log.truncated) == (True, False)
        assert printed["outcome"] == log.result["outcome"] == "aborted"
        assert printed["ticks"] == log.result["ticks"] == len(log.trajectory().command) > 0


def test_an_interrupt_before_the_run_is_one_line(mjnav, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("mjnav.cli.run.load_scenario", interrupt)
    said = mjnav("run", "hall")
    assert (said.code, said.out, said.err) == (130, "", "mjnav: interrupted\n")


def test_a_killed_run_leaves_a_readable_log(start, tmp_path):
    path = tmp_path / "a.mcap"
    process = start("run", "crossing1", "--real-time", "--log", path, *LONG)
    wait_for(path)
    process.send_signal(signal.SIGKILL)
    process.wait(timeout=PATIENCE)
    log = open_log(path)
    assert (log.complete, log.truncated) == (False, True)
    assert log.run["scene"] == "crossing1"


@pytest.mark.parametrize("handled", [signal.SIGINT, signal.SIGTERM])
def test_handlers_are_given_back_after_a_run(mjnav, handled):
    before = signal.getsignal(handled)
    assert mjnav("run", "crossing1", "--no-log", "--set", "time_limit=0.2").code == 0
    assert signal.getsignal(handled) is before
