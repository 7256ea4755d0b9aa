"""The load beside a test: what is started is ended."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from mjnav.loop.realtime import stress as module
from mjnav.loop.realtime.stress import stress

pytestmark = pytest.mark.xdist_group("real time")

PATIENCE = 60.0  # [s] on a busy machine


def stat(pid: int) -> list[str]:
    """State, parent and what follows; nothing where there is no such process, or only its exit code."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
    except OSError:
        return []
    return [] if words[0] in "ZX" else words


def children(parent: int) -> set[int]:
    pids = (int(name) for name in os.listdir("/proc") if name.isdigit())
    return {pid for pid in pids if (words := stat(pid)) and int(words[1]) == parent}


def test_a_process_for_every_cpu_and_one_for_the_disk_run_until_the_end():
    before = children(os.getpid())
    with stress() as load:
        started = children(os.getpid()) - before
        num_cpus = len(os.sched_getaffinity(0))
        assert len(started) == num_cpus + 1
        assert load.startswith(f"{num_cpus} computing processes and one that writes")
    assert not any(stat(pid) for pid in started)
    assert children(os.getpid()) == before


def test_none_is_left_where_one_cannot_be_started(monkeypatch):
    before, started = children(os.getpid()), []
    popen = subprocess.Popen

    def failing(*arguments, **options):
        if started:
            raise BlockingIOError(11, "Resource temporarily unavailable")
        started.append(popen(*arguments, **options))
        return started[-1]

    monkeypatch.setattr(module.subprocess, "Popen", failing)
    with pytest.raises(BlockingIOError), stress():
        pass
    assert started[0].poll() is not None
    assert children(os.getpid()) == before


def test_they_end_themselves_when_their_parent_was_killed():
    held = "with stress():\n    print(flush=True)\n    time.sleep(600)"
    code = f"import time\nfrom mjnav.loop.realtime.stress import stress\n{held}"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        orphans = children(process.pid)
        process.send_signal(signal.SIGKILL)
    try:
        assert orphans
        ends = time.monotonic() + PATIENCE
        while any(stat(pid) for pid in orphans):
            assert time.monotonic() < ends, "they go on"
            time.sleep(0.05)
    finally:
        for pid in orphans:
            if stat(pid):
                os.kill(pid, signal.SIGKILL)
