"""Detects when the machine itself stood still in a real-time test, by a probe on a CPU that the loop does not use.

With one CPU, the probe runs for a while before the test instead. That describes the machine, but explains no miss.
"""

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

CALIBRATION = 2.0  # [s] before the test, where there is one CPU
PATIENCE = 10.0  # [s] for the probe to start and to answer


@dataclass(slots=True)
class Gaps:
    """What the probe saw; filled in when it ends."""

    seen: str = "nothing: the probe did not answer"  # by whom and when, for people
    intervals: NDArray[np.int64] = field(default_factory=lambda: np.empty((0, 2), np.int64))  # begin, end [ns]
    own: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, np.bool_))  # those of the probe's CPU alone
    during: bool = False  # the test, not before it

    @property
    def everywhere(self) -> NDArray[np.int64]:
        """(m, 2) of the gaps in which the loop stood still, too, by the clock that it is paced by [ns]."""
        return self.intervals[~self.own] if self.during else self.intervals[:0]

    @property
    def summary(self) -> dict[str, int | float | str]:
        """How many gaps, the longest and all together [ms], and who saw them."""
        lengths = np.diff(self.intervals, axis=1) * 1e-6
        longest = float(lengths.max()) if lengths.size else 0.0
        return {"count": len(lengths), "longest_ms": longest, "total_ms": float(lengths.sum()), "seen": self.seen}


@contextmanager
def gap_probe(cpus: set[int]) -> Iterator[Gaps]:
    """Watches the machine while the context lasts; what was seen is there when it has closed.

    `cpus` are those that the process may use, of which `realtime_scheduling` gives the loop the last.
    """
    gaps = Gaps()
    program = [sys.executable, "-I", "-S", str(Path(__file__).with_name("gap_spinner.py")), str(min(cpus))]
    if len(cpus) == 1:
        with suppress(OSError, subprocess.TimeoutExpired):
            done = subprocess.run([*program, str(CALIBRATION)], capture_output=True, timeout=CALIBRATION + PATIENCE)
            _fill(gaps, done.stdout)
            gaps.seen += f" in {CALIBRATION:g} s before the test, for want of another CPU"
        yield gaps
        return
    try:
        probe = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    except OSError as error:
        gaps.seen = f"nothing: the probe did not start ({error.strerror})"
        yield gaps
        return
    with probe:
        assert probe.stdout is not None
        try:
            probe.stdout.readline()  # until it spins
            yield gaps
            probe.terminate()
            with suppress(subprocess.TimeoutExpired):
                _fill(gaps, probe.communicate(timeout=PATIENCE)[0])
                gaps.during = True
        finally:
            probe.kill()


def _fill(gaps: Gaps, said: bytes) -> None:
    """Fills `gaps` from the probe's output, if there is any."""
    with suppress(ValueError):
        found = json.loads(said.strip().rpartition(b"\n")[2])
        share = 1.0 - found["waited"] / max(1, found["spun"])
        rows = np.array(found["gaps"], np.int64).reshape(-1, 3)
        gaps.intervals, gaps.own = rows[:, :2], rows[:, 2] == 1
        gaps.seen = f"by a probe that had CPU {found['cpu']} {100.0 * share:.0f} % of the time"


class Usage(NamedTuple):
    """How the calling thread's time was spent so far [ns]."""

    before: int  # CLOCK_MONOTONIC before all else was read; a thread may lose its CPU between two readings
    ran: int
    waited: int  # for its CPU
    yielded: int  # how often it gave up its CPU voluntarily
    page_faults: int  # that were served without a disk
    after: int  # and once it was


class UsageMeter:
    """Reads the usage of the thread that made it; in some microseconds, so that it may be done every tick."""

    def __init__(self):
        try:
            self._statistics: int | None = os.open("/proc/thread-self/schedstat", os.O_RDONLY)
        except OSError:  # a kernel without
            self._statistics = None

    def read(self) -> Usage:
        """The usage now."""
        before = time.perf_counter_ns()
        used = resource.getrusage(resource.RUSAGE_THREAD)
        waited = 0 if self._statistics is None else int(os.pread(self._statistics, 64, 0).split()[1])
        ran = time.thread_time_ns()
        return Usage(before, ran, waited, used.ru_nvcsw, used.ru_minflt, time.perf_counter_ns())

    def close(self) -> None:
        """Closes the kernel's statistics."""
        if self._statistics is not None:
            os.close(self._statistics)


def stolen(began: Sequence[Usage], ended: Sequence[Usage]) -> NDArray[np.int64]:
    """(n,) how long the hypervisor took the loop's CPU away between each pair [ns]; 0 where it does not tell.

    A thread that neither ran nor waited for its CPU nor gave it away was on it, and the CPU was not there.
    """
    begin, end = (np.array(usages, np.int64).reshape(-1, len(Usage._fields)) for usages in (began, ended))
    _, ran, waited, yielded, _, _ = (end - begin).T
    wall = end[:, Usage._fields.index("before")] - begin[:, Usage._fields.index("after")]
    return np.where(yielded == 0, np.maximum(0, wall - ran - waited), 0)
