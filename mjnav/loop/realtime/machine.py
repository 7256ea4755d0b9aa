"""What took time in a real-time test beside the loop's own work.

The machine itself stood still, which a probe sees on a CPU that the loop does not use; the hypervisor took the loop's
CPU away; or the process did work that it does only once and that should not happen in a tick: compiling or loading a
kernel, importing.
"""

import builtins
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
from numba.core import event
from numpy.typing import NDArray

PATIENCE = 10.0  # [s] for the probe to answer
KERNELS = "numba:compiler_lock"  # held while a kernel is compiled, and while one is loaded from the cache
NONE = np.empty((0, 2), np.int64)

# ----------------------------------------------------------------------------- the machine stood still


@dataclass(slots=True)
class Gaps:
    """What the probe saw; filled in when it ends. Intervals (m, 2) are begins and ends by CLOCK_MONOTONIC [ns]."""

    seen: str = "nothing: the probe did not answer"  # by whom, for people
    intervals: NDArray[np.int64] = field(default_factory=NONE.copy)
    everywhere: NDArray[np.int64] = field(default_factory=NONE.copy)  # those in which the loop stood still, too

    @property
    def summary(self) -> dict[str, int | float | str]:
        """How many gaps, the longest and all together [ms], and who saw them."""
        lengths = np.diff(self.intervals, axis=1) * 1e-6
        longest = float(lengths.max()) if lengths.size else 0.0
        return {"count": len(lengths), "longest_ms": longest, "total_ms": float(lengths.sum()), "seen": self.seen}


@contextmanager
def gap_probe(cpus: set[int]) -> Iterator[Gaps]:
    """Watches the machine while the context lasts; what was seen is there when it has closed.

    `cpus` are those that the process may use, of which `realtime_scheduling` gives the loop the last. With one CPU
    there is none for the probe.
    """
    gaps = Gaps()
    if len(cpus) == 1:
        gaps.seen = "nothing: a probe needs a second CPU"
        yield gaps
        return
    program = [sys.executable, "-I", "-S", str(Path(__file__).with_name("gap_spinner.py")), str(min(cpus))]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as probe:
        assert probe.stdout is not None
        try:
            probe.stdout.readline()  # until it spins
            yield gaps
            probe.terminate()
            with suppress(subprocess.TimeoutExpired):
                _fill(gaps, probe.communicate(timeout=PATIENCE)[0])
        finally:
            probe.kill()


def _fill(gaps: Gaps, answer: bytes) -> None:
    """Fills `gaps` from the probe's output, if there is any."""
    with suppress(ValueError):
        answered = json.loads(answer)
        share = 1.0 - answered["waited"] / max(1, answered["spun"])
        rows = np.array(answered["gaps"], np.int64).reshape(-1, 3)
        gaps.intervals, gaps.everywhere = rows[:, :2], rows[rows[:, 2] == 0, :2]
        gaps.seen = f"by a probe that had CPU {answered['cpu']} {100.0 * share:.0f} % of the time"


# ------------------------------------------------------------------------------- the loop's own thread


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


# ------------------------------------------------------------------------------------ first-time work


class FirstTimeWork(event.Listener):
    """Records when such work was done, on any thread."""

    def __init__(self):
        self._since: list[int] = []  # of what has begun and not ended
        self._done: list[tuple[int, int]] = []

    @property
    def intervals(self) -> NDArray[np.int64]:
        """(m, 2) begins and ends by CLOCK_MONOTONIC [ns], one within another where such work led to more of it."""
        return np.array(self._done, np.int64).reshape(-1, 2)

    def on_start(self, event: event.Event) -> None:
        """A kernel is about to be compiled or loaded."""
        self._since.append(time.perf_counter_ns())

    def on_end(self, event: event.Event) -> None:
        """It has been compiled or loaded."""
        if self._since:
            self.add(self._since.pop())

    def add(self, since: int) -> None:
        """Such work began at `since` [ns] and ends now."""
        self._done.append((since, time.perf_counter_ns()))


@contextmanager
def first_time_work() -> Iterator[FirstTimeWork]:
    """Records such work while the context lasts."""
    work, import_module = FirstTimeWork(), builtins.__import__

    def timed(*arguments, **options):
        since, loaded = time.perf_counter_ns(), len(sys.modules)
        try:
            return import_module(*arguments, **options)
        finally:
            if len(sys.modules) > loaded:
                work.add(since)

    builtins.__import__ = timed
    try:
        with event.install_listener(KERNELS, work):
            yield work
    finally:
        builtins.__import__ = import_module
