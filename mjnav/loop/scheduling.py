"""What a process can ask of Linux for real time. Each is tried, none is needed, and what was got is reported."""

import ctypes
import gc
import os
import resource
import sys
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass

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
