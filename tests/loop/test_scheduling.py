"""What is asked of the machine for real time is given back, and a machine that gives nothing is no error."""

import gc
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from mjnav.loop.pacer import OTHER_THREADS_PRIORITY, realtime_scheduling

pytestmark = pytest.mark.xdist_group("real time")


def asked_for() -> tuple:
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority, os.sched_getaffinity(0)


def may_use_fifo() -> bool:
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, *before)
    return True


def test_what_was_changed_is_restored_also_after_an_exception():
    before = asked_for()
    frozen = gc.get_freeze_count()
    with realtime_scheduling() as got:
        assert str(got).startswith("scheduler SCHED_")
        assert gc.get_freeze_count() > frozen
    assert asked_for() == before
    assert gc.get_freeze_count() == 0
    with pytest.raises(ZeroDivisionError), realtime_scheduling():
        _ = 1 / 0
    assert asked_for() == before


@pytest.fixture
def helper():
    """Starts threads that wait for the test's end; gives their ids."""
    over, threads = threading.Event(), []

    def start() -> int:
        threads.append(threading.Thread(target=over.wait))
        threads[-1].start()
        return threads[-1].native_id

    yield start
    over.set()
    for thread in threads:
        thread.join()


def scheduling(thread: int) -> tuple[int, int]:
    return os.sched_getscheduler(thread), os.sched_getparam(thread).sched_priority


needs_fifo = pytest.mark.skipif(not may_use_fifo(), reason="this process may not use SCHED_FIFO")


@needs_fifo
def test_other_threads_run_under_fifo_below_the_loops_and_as_before_afterwards(helper):
    ordinary, urgent = helper(), helper()
    os.sched_setscheduler(urgent, os.SCHED_FIFO, os.sched_param(30))
    with realtime_scheduling() as got:
        assert scheduling(0) == (os.SCHED_FIFO, 50)
        assert scheduling(ordinary) == scheduling(urgent) == (os.SCHED_FIFO, OTHER_THREADS_PRIORITY)
        assert got.scheduler == "SCHED_FIFO 50"
        later = helper()
    assert scheduling(ordinary) == (os.SCHED_OTHER, 0)
    assert scheduling(urgent) == (os.SCHED_FIFO, 30)
    assert scheduling(later) == (os.SCHED_OTHER, 0)  # inherited what the loop had


# What a process does that is granted nothing: it says what it got, and allocates four times what it may lock.
UNPRIVILEGED = """
import json, resource
from dataclasses import asdict
import numpy as np
from mjnav.loop.pacer import realtime_scheduling

limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)
with realtime_scheduling() as got:
    held = [np.ones(1 << 17) for _ in range(max(64, 4 * limit[0] >> 20))]
    status = open("/proc/self/status").read()
locked = int(status.partition("VmLck:")[2].split()[0])
kept = limit == resource.getrlimit(resource.RLIMIT_MEMLOCK)
print(json.dumps({**asdict(got), "locked_kib": locked, "limit": limit[0], "kept": kept}))
"""
LAUNCHER = Path(__file__).parents[1] / "unprivileged.py"


@pytest.mark.parametrize("limit", [0, 64 << 10, 8 << 20, 4 << 30])  # the last holds all that the process begins with
def test_without_any_privilege_it_goes_on_locks_nothing_and_says_why(limit):
    command = [sys.executable, str(LAUNCHER), str(limit), sys.executable, "-c", UNPRIVILEGED]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    got = json.loads(done.stdout)
    assert got["scheduler"] == "SCHED_OTHER (SCHED_FIFO: Operation not permitted)"
    assert got["affinity"] == "any CPU"
    assert got["memory"] == f"not locked (RLIMIT_MEMLOCK is {got['limit'] // 1024} KiB)"
    assert (got["locked_kib"], got["kept"]) == (0, True)


def test_memory_is_locked_where_nothing_bounds_it():
    with realtime_scheduling() as got:
        locked = int(Path("/proc/self/status").read_text().partition("VmLck:")[2].split()[0])
    assert (got.memory == "locked") == (locked > 0)
    assert got.memory == "locked" or got.memory.startswith("not locked (")
