"""Stalls of each kind, real ones, and whom the rate test lays the missed deadlines on."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytestmark = pytest.mark.xdist_group("real time")

PATIENCE = 120.0  # [s] on a busy machine
STOPPED = 0.4  # [s]
STALLING = '''
import importlib, os, sys, time
from numba import njit
from mjnav.control.methods.mean import Mean

sys.path.insert(0, os.path.dirname(__file__))

class Stalling(Mean):
    """Computes too long at tick 10, compiles at tick 20, imports at tick 30."""

    def decide(self, observation):
        self.tick = getattr(self, "tick", -1) + 1
        if self.tick == 10:
            ends = time.perf_counter() + 0.12
            while time.perf_counter() < ends:
                pass
        if self.tick == 20:
            @njit
            def never_seen(values):
                return sorted([value * 2.0 for value in values if value > 1.0])
            never_seen([1.0, 2.0])
        if self.tick == 30:
            import slowly_imported
        return super().decide(observation)
'''
IMPORTED = """
import time
ends = time.perf_counter() + 0.12
while time.perf_counter() < ends:
    pass
"""


@pytest.fixture
def start(tmp_path):
    """Starts a rate test at 20 Hz as a process group of its own."""
    started = []

    def start(*words: str) -> subprocess.Popen:
        command = [sys.executable, "-m", "mjnav.cli.main", "rate-test", "crossing1", "--rate", "20", "--json", *words]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        started.append(subprocess.Popen(command, cwd=tmp_path, start_new_session=True, **pipes))
        return started[-1]

    yield start
    for process in started:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
        process.communicate()


def child(parent: int) -> int:
    """The one process that another started."""
    (found,) = Path(f"/proc/{parent}/task/{parent}/children").read_text().split()
    return int(found)


def misses(report: dict, cause: str) -> dict[int, tuple[str, float]]:
    """Phase and overrun [ms] of the misses of a cause that began in their own tick, by tick."""
    found = [miss for miss in report["missed"] if miss["cause"] == cause and miss["since"] == miss["tick"]]
    return {miss["tick"]: (miss["phase"], miss["milliseconds"]) for miss in found}


def test_a_slow_tick_is_the_loops_and_compiling_is_first_time_work(start, tmp_path):
    (tmp_path / "stalling.py").write_text(STALLING)
    (tmp_path / "slowly_imported.py").write_text(IMPORTED)
    process = start("--controller", "stalling:Stalling", "--duration", "2.5")
    out, err = process.communicate(timeout=PATIENCE)
    report = json.loads(out)
    assert process.returncode in (0, 1), err
    phase, milliseconds = misses(report, "loop")[10]
    assert (phase, milliseconds > 70.0) == ("control", True)
    by_first_time = misses(report, "first-time work")
    assert by_first_time[20][0] == by_first_time[30][0] == "control", report["missed"]
    assert by_first_time[30][1] > 70.0
    counts = report["misses_by_cause"]
    assert counts["loop"] >= 1
    assert counts["first-time work"] >= 2
    assert sum(counts.values()) == report["deadline_misses"]


@pytest.mark.nightly
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="the probe needs a second CPU")
def test_a_stop_of_all_is_the_machines_and_of_the_loop_alone_is_not(start, tmp_path):
    log = tmp_path / "a.mcap"
    process = start("--log", str(log), "--duration", "600", "--set", "physics.engine=kinematic")
    ends = time.monotonic() + PATIENCE
    while not (log.exists() and log.stat().st_size > 60_000):
        assert time.monotonic() < ends, "the test did not begin"
        time.sleep(0.02)
    loop = child(process.pid)
    os.kill(child(loop), signal.SIGINT)  # the probe, to which a terminal sends it, too
    for stop, whom in ((os.killpg, process.pid), (os.kill, loop)):
        stop(whom, signal.SIGSTOP)
        time.sleep(STOPPED)
        stop(whom, signal.SIGCONT)
        time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, err.splitlines()[-1]) == (130, "mjnav: interrupted"), err
    report = json.loads(out)
    long = {cause: max(ms for _, ms in misses(report, cause).values()) for cause in ("machine", "loop")}
    for milliseconds in long.values():
        assert milliseconds + 50.0 >= 1e3 * STOPPED - 50.0  # what was left of the period
    first, second = (next(t for t, m in misses(report, c).items() if m[1] == long[c]) for c in ("machine", "loop"))
    assert first < second
    gaps = report["machine_gaps"]
    assert gaps["count"] >= 1
    assert 1e3 * STOPPED * 0.9 < gaps["longest_ms"] <= gaps["total_ms"]
    assert gaps["seen"].startswith("by a probe that had CPU ")
