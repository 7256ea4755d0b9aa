"""Pacing of a run by the wall clock: real-time scheduling, when a tick may begin, and how long its phases took.

A process asks Linux for real-time scheduling. Each request is tried, none is needed, and what was got is reported.

Only this module reads a clock for when a tick may begin and how long its phases took. The clock never reaches the
simulation: a run paced, late or unpaced has the same states.
"""

import ctypes
import gc
import os
import resource
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from mjnav.errors import unknown_name
from mjnav.messages import PHASES, Array

# --------------------------------------------------------------------------------------- scheduling


MCL_CURRENT, MCL_FUTURE = 1, 2  # from <sys/mman.h>
FIFO_PRIORITY = 50
# Of the other threads, the log's among them: below the loop's, above whatever else runs. While one of them holds the
# interpreter's lock the loop waits for it, so it must not lose its processor to a busy process (35 ms were seen).
OTHER_THREADS_PRIORITY = 10
SWITCH_INTERVAL = 2e-4  # [s]; Python's own is 5 ms, which the loop would wait where the log's thread computes


@dataclass(frozen=True, slots=True)
class Scheduling:
    """What a process got of what it asked for, in words."""

    scheduler: str
    memory: str
    affinity: str

    @property
    def privileged(self) -> bool:
        """Whether the process has something that other processes may miss."""
        return self.scheduler.startswith("SCHED_FIFO") or self.memory == "locked"

    def __str__(self) -> str:
        return ", ".join(f"{name} {value}" for name, value in asdict(self).items())


@contextmanager
def realtime_scheduling() -> Iterator[Scheduling]:
    """SCHED_FIFO with one CPU, and locked memory, while the context lasts; yields what was got.

    The garbage collector's view of what exists is frozen, so that no full collection (14 ms) hits a tick, and the log's
    thread gives the interpreter back within SWITCH_INTERVAL.
    """
    policies, cpus = _policies(), os.sched_getaffinity(0)
    loop = threading.get_native_id()
    libc, switch_interval = ctypes.CDLL(None, use_errno=True), sys.getswitchinterval()
    try:
        got = Scheduling(
            scheduler=_take_fifo(policies.keys() - {loop}),
            memory=_lock_memory(libc),
            affinity=_take_cpu(cpus) if os.sched_getscheduler(0) == os.SCHED_FIFO else "any CPU",
        )
        sys.setswitchinterval(SWITCH_INTERVAL)
        gc.collect()
        gc.freeze()
        yield got
    finally:
        gc.unfreeze()
        sys.setswitchinterval(switch_interval)
        libc.munlockall()
        with suppress(OSError):
            os.sched_setaffinity(0, cpus)
        for thread in _policies():
            with suppress(OSError):
                os.sched_setscheduler(thread, *policies.get(thread, policies[loop]))


def _take_fifo(helpers: Iterable[int]) -> str:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except OSError as error:
        return f"SCHED_OTHER (SCHED_FIFO: {error.strerror})"
    for thread in helpers:
        with suppress(OSError):  # it may just have ended
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(OTHER_THREADS_PRIORITY))
    return f"SCHED_FIFO {FIFO_PRIORITY}"


def _policies() -> dict[int, tuple[int, os.sched_param]]:
    """Scheduling policy and priority of each of this process's threads."""
    found = {}
    for thread in map(int, os.listdir("/proc/self/task")):
        with suppress(OSError):  # it may just have ended
            found[thread] = os.sched_getscheduler(thread), os.sched_getparam(thread)
    return found


def _lock_memory(libc: ctypes.CDLL) -> str:
    """Locks what is there and what will be allocated, but only where nothing bounds it.

    Under a finite RLIMIT_MEMLOCK MCL_FUTURE would make the first allocation beyond the limit fail in the middle of the
    run. MCL_CURRENT alone is no way out: a locked stack that grows beyond the limit ends the process.
    """
    limit = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0]
    if limit != resource.RLIM_INFINITY and not _ignores_limits(libc):
        return f"not locked (RLIMIT_MEMLOCK is {limit // 1024} KiB)"
    if libc.mlockall(MCL_CURRENT | MCL_FUTURE) == 0:
        return "locked"
    return f"not locked ({os.strerror(ctypes.get_errno())})"


def _ignores_limits(libc: ctypes.CDLL) -> bool:
    """Whether the kernel lets this process lock memory beyond RLIMIT_MEMLOCK: CAP_IPC_LOCK of the whole machine.

    The kernel itself is asked, with a limit of nothing: in a container /proc/self/status may name a capability that
    holds only inside it.
    """
    before, page = resource.getrlimit(resource.RLIMIT_MEMLOCK), ctypes.create_string_buffer(1)
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, before[1]))
    try:
        return libc.mlock(page, ctypes.c_size_t(1)) == 0 and libc.munlock(page, ctypes.c_size_t(1)) == 0
    finally:
        resource.setrlimit(resource.RLIMIT_MEMLOCK, before)


def _take_cpu(cpus: set[int]) -> str:
    """One of the CPUs that the process may use, so that caches stay warm.

    Under SCHED_FIFO only: without it the loop would wait for what else runs on that CPU (270 and 310 ms were seen on a
    machine at a load of 5, where a loop that may move was at most 60 ms late).
    """
    cpu = max(cpus)
    if len(cpus) > 1:
        try:
            os.sched_setaffinity(0, {cpu})
        except OSError as error:
            return f"any ({error.strerror})"
    return f"CPU {cpu}"


# ------------------------------------------------------------------------------------------- pacers


Clock = Callable[[], int]
POLICIES = ("skip", "abort")
SPIN = 300_000  # [ns] before a deadline in which the pacer spins instead of sleeping: a sleep wakes 50-150 us late
MAX_CATCH_UP = 3  # periods that may be made up for before whole periods are skipped


@dataclass(frozen=True, slots=True)
class Start:
    """How a tick began: `lateness` [ns] behind its deadline, and whether the tick before it was still at work then.

    Before it, `skipped` whole periods were dropped from the schedule; `abort` asks for the end of the run.
    """

    lateness: int
    missed: bool
    skipped: int = 0
    abort: bool = False


class Pacer(Protocol):
    """Says when the next tick may begin; `now` is the clock [ns]."""

    now: Clock
    real_time: bool  # whether time on the wall counts

    def wait(self) -> Start:
        """Returns when the next tick may begin."""
        ...


class FreePacer:
    """Begins every tick at once: as fast as the machine can."""

    real_time = False

    def __init__(self, clock: Clock = time.perf_counter_ns):
        self.now = clock

    def wait(self) -> Start:
        """Never waits."""
        return Start(0, False)


class RealTimePacer:
    """Begins tick k at start + k period on the wall: sleeps, then spins the last stretch.

    A tick misses its deadline if the one before it was still at work at that moment. What is late by no more than
    `max_catch_up` periods is caught up with; beyond that the schedule moves on by whole periods, keeping its phase.
    Under the policy "abort" the first deadline missed ends the run instead. Raises InvalidValue for another policy.
    """

    real_time = True

    def __init__(
        self,
        period: float,
        *,
        max_catch_up: int = MAX_CATCH_UP,
        policy: str = "skip",
        clock: Clock = time.perf_counter_ns,
        sleep: Callable[[float], None] = time.sleep,
    ):
        if policy not in POLICIES:
            raise unknown_name("overruns", policy, POLICIES)
        self.now = clock
        self._policy = policy
        self._sleep = sleep
        self._period = round(period * 1e9)
        self._max_catch_up = max_catch_up
        self._deadline: int | None = None

    def wait(self) -> Start:
        """Returns at the next tick's deadline, at once if it has passed. The first call starts the schedule."""
        now = self.now()
        if self._deadline is None:
            self._deadline = now
        else:
            self._deadline += self._period
        missed = now > self._deadline
        if missed and self._policy == "abort":
            return Start(now - self._deadline, missed, abort=True)
        skipped = (now - self._deadline) // self._period
        skipped = skipped if skipped > self._max_catch_up else 0
        self._deadline += skipped * self._period
        while (left := self._deadline - self.now()) > 0:
            if left > SPIN:
                self._sleep((left - SPIN) * 1e-9)
        return Start(max(0, self.now() - self._deadline), missed, skipped)


# ---------------------------------------------------------------------------------------- stopwatch


# span -> the phase of `messages.PHASES` that it is a part of
SPANS = MappingProxyType(
    {
        "truth": "sense",
        "readings": "sense",
        "estimate": "estimate",
        "predict": "control",
        "decide": "control",
        "actuate": "record",
        "write": "record",
        "advance": "advance",
    }
)
BETWEEN = "between"  # the end of a tick's last span and the start of the next tick


class Stopwatch:
    """Times the spans of one tick after another; `spans` are those of the present tick [ns].

    What passes between two spans belongs to the second, unless `pauses`: then it belongs to none.
    """

    def __init__(self, now: Clock = time.perf_counter_ns, *, pauses: bool = False):
        self._now = now
        self._pauses = pauses
        self.spans: dict[str, int] = {}
        self._since: int | None = None  # when the running span began

    def start(self) -> None:
        """A new tick begins; the time since the last span of the tick before is added to that tick's spans."""
        now = self._now()
        if self._since is not None and not self._pauses:
            self.spans[BETWEEN] = now - self._since
        self.spans, self._since = {}, now

    def resume(self) -> None:
        """The next span begins now, where there are pauses between spans."""
        if self._pauses:
            self._since = self._now()

    def lap(self, span: str) -> None:
        """The running span, which is called `span`, ends; the next begins."""
        now = self._now()
        assert self._since is not None, "start() comes before lap()"
        self.spans[span] = now - self._since
        self._since = now

    @property
    def elapsed(self) -> float:
        """The tick's spans so far [s]."""
        return 1e-9 * sum(self.spans.values())

    @property
    def phases(self) -> tuple[int, ...]:
        """The tick's time by phase [ns], in the order of PHASES."""
        taken: dict[str, int] = dict.fromkeys(PHASES, 0)
        for span, time_ns in self.spans.items():
            taken[SPANS[span]] += time_ns
        return tuple(taken.values())


# ------------------------------------------------------------------------------------------ profile


def profile_of(ticks: Sequence[Mapping[str, int]]) -> dict[str, Any]:
    """Where a run's time went, from the spans [ns] of every tick, as `Stopwatch.spans` has them.

    {"ticks", "tick_us", "phases": {phase: {"p50", "p99", "mean", "share", "parts"}}}, times in us; `parts` are a
    phase's spans where it has more than one. Inside a span, `python -m cProfile -m mjnav.cli.main run SCENE` looks.
    """
    if not ticks:
        return {"ticks": 0, "tick_us": None, "phases": {}}
    spans = {name: np.array([tick.get(name, 0) for tick in ticks], float) for name in (*SPANS, BETWEEN)}
    whole = np.sum(list(spans.values()), axis=0)
    phases = {}
    for phase in (*PHASES, BETWEEN):
        own = {name: taken for name, taken in spans.items() if SPANS.get(name, BETWEEN) == phase}
        parts = {name: _figures(taken, whole) for name, taken in own.items()} if len(own) > 1 else {}
        phases[phase] = {**_figures(np.sum(list(own.values()), axis=0), whole), "parts": parts}
    tick = _figures(whole, whole)
    del tick["share"]
    return {"ticks": len(ticks), "tick_us": tick, "phases": phases}


def profile_table(profile: Mapping[str, Any]) -> str:
    """The figures of `profile_of` as a table for people."""
    lines = [f"{'us a tick':20s}{'p50':>9s}{'p99':>9s}{'mean':>9s}{'share':>8s}"]
    for name, phase in profile["phases"].items():
        lines += [_row(name, phase), *(_row(f"  {part}", taken) for part, taken in phase["parts"].items())]
    return "\n".join(
        lines if profile["tick_us"] is None else [*lines, _row("tick", {**profile["tick_us"], "share": 1.0})]
    )


def _figures(taken: Array, whole: Array) -> dict[str, float]:
    """What one span or phase took of every tick [us], and its share of all ticks' time."""
    p50, p99 = (1e-3 * np.quantile(taken, (0.5, 0.99))).tolist()
    share = float(taken.sum() / whole.sum()) if whole.any() else 0.0
    return {"p50": p50, "p99": p99, "mean": 1e-3 * float(taken.mean()), "share": share}


def _row(name: str, taken: Mapping[str, float]) -> str:
    return f"{name:20s}{taken['p50']:9.1f}{taken['p99']:9.1f}{taken['mean']:9.1f}{100.0 * taken['share']:7.1f}%"
