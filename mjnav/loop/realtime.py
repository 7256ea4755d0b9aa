"""What a process can ask of Linux for real time. Each is tried, none is needed, and what was got is reported."""

import ctypes
import gc
import os
from collections.abc import Iterator
from contextlib import contextmanager

MCL_CURRENT, MCL_FUTURE = 1, 2  # from <sys/mman.h>
FIFO_PRIORITY = 50


@contextmanager
def real_time() -> Iterator[dict[str, str]]:
    """SCHED_FIFO, locked memory and one CPU while the context lasts; yields what was got, by name.

    The garbage collector's view of what exists is frozen, so that no full collection (14 ms) hits a tick.
    """
    got = {"scheduler": "SCHED_OTHER", "memory": "not locked", "affinity": "any"}
    policy, priority = os.sched_getscheduler(0), os.sched_getparam(0)
    cpus = os.sched_getaffinity(0)
    libc = ctypes.CDLL(None, use_errno=True)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
        got["scheduler"] = f"SCHED_FIFO {FIFO_PRIORITY}"
    except OSError as error:
        got["scheduler"] = f"SCHED_OTHER (SCHED_FIFO: {error.strerror})"
    if libc.mlockall(MCL_CURRENT | MCL_FUTURE) == 0:
        got["memory"] = "locked"
    else:
        got["memory"] = f"not locked ({os.strerror(ctypes.get_errno())})"
    if len(cpus) > 1:
        os.sched_setaffinity(0, {max(cpus)})
        got["affinity"] = f"CPU {max(cpus)}"
    gc.collect()
    gc.freeze()
    try:
        yield got
    finally:
        gc.unfreeze()
        os.sched_setaffinity(0, cpus)
        libc.munlockall()
        os.sched_setscheduler(0, policy, priority)
