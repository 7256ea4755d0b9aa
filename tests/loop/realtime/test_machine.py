"""What a thread's time went to: only what nobody can account for was stolen from it."""

import os
import subprocess
import sys
import time

import pytest

from mjnav.loop.realtime.machine import Usage, UsageMeter, stolen

pytestmark = pytest.mark.xdist_group("real time")
MS = 1_000_000  # [ns]
BUSY = "import os, sys\nos.sched_setaffinity(0, {int(sys.argv[1])})\nprint(flush=True)\nwhile True: pass"


def usage(at: float, ran: float, waited: float = 0.0, yielded: int = 0) -> Usage:
    """Of readings that took 0.1 ms; times in ms."""
    return Usage(round(at * MS), round(ran * MS), round(waited * MS), yielded, 0, round((at + 0.1) * MS))


def test_stolen_is_what_was_neither_run_nor_waited_nor_given_away():
    began = usage(100.0, 50.0, 7.0, 3)
    ended = {10.0: usage(120.1, 60.0, 7.0, 3), 4.0: usage(120.1, 60.0, 13.0, 3), 0.0: usage(120.1, 70.0, 7.0, 3)}
    assert stolen([began] * len(ended), list(ended.values())).tolist() == [ms * MS for ms in ended]
    slept = usage(120.1, 60.0, 7.0, 4)  # or was stopped, or waited for a lock
    assert stolen([began], [slept]).tolist() == [0]
    assert stolen([usage(0.0, 0.0)], [usage(5.0, 4.99)]).tolist() == [0]  # readings that were made one after another
    assert stolen([], []).tolist() == []


def test_what_a_thread_waits_for_its_cpu_or_sleeps_was_not_stolen():
    cpus, meter = os.sched_getaffinity(0), UsageMeter()
    began, ended = [], []
    with subprocess.Popen([sys.executable, "-c", BUSY, str(min(cpus))], stdout=subprocess.PIPE) as busy:
        try:
            busy.stdout.readline()
            os.sched_setaffinity(0, {min(cpus)})
            over = time.monotonic() + 1.5
            while time.monotonic() < over:
                began.append(meter.read())
                ends = time.monotonic() + 1e-3
                while time.monotonic() < ends:
                    pass
                ended.append(meter.read())
        finally:
            os.sched_setaffinity(0, cpus)
            busy.kill()
    waited = ended[-1].waited - began[0].waited
    assert waited > 100 * MS
    assert stolen(began, ended).sum() < 0.1 * waited  # and that is the machine's own

    began = meter.read()
    time.sleep(0.05)
    assert stolen([began], [meter.read()]).tolist() == [0]
    meter.close()
