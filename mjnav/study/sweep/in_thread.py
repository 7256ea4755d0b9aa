"""A trial in a thread of a process that mjnav did not start, such as a Dask worker, watched by a second thread.

A tick that hangs in Python code is ended by an exception in its thread. Where that does not help, as in compiled code
that never returns, the process ends: Dask gives the trial to another worker, `distributed.scheduler.allowed-failures`
times. Code that hangs and holds the interpreter's lock also stops the worker's heartbeat to Dask, which ends it after
`distributed.scheduler.worker-ttl`.
"""

import ctypes
import logging
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from mjnav.loop.faults.heartbeat import END_TIMEOUT, STALL, Heartbeat, TimeUp
from mjnav.study.kept_logs import wants_log, with_log
from mjnav.study.store.row import Row
from mjnav.study.trial import Trial, failed_row, run_trial

_POLL = 0.5  # [s]


def run_in_thread(trial: Trial, max_seconds: float) -> Row:
    """The trial's row, run on this thread; a failed row where it took longer than `max_seconds` of wall time."""
    with _watched(trial, max_seconds) as heart:
        row = run_trial(trial, beat=heart)
    if heart.over is not None:
        return failed_row(trial, heart.over, row.wall_s)
    if not wants_log(trial, row):
        return row
    with _watched(trial, max_seconds) as heart:
        return with_log(trial, row, heart)


@contextmanager
def _watched(trial: Trial, max_seconds: float) -> Iterator[Heartbeat]:
    """A heartbeat for a run of the trial on this thread; a second thread watches it meanwhile."""
    heart, done = Heartbeat(max_seconds), threading.Event()
    watch = threading.Thread(target=_watch, args=(trial.label, heart, threading.get_ident(), done), daemon=True)
    watch.start()
    try:
        yield heart
    finally:
        done.set()


def _watch(name: str, heart: Heartbeat, thread: int, done: threading.Event) -> None:
    log, told = logging.getLogger("distributed.worker"), False
    while not done.wait(_POLL):
        if heart.quiet >= STALL and not told:
            told = True
            log.warning("%s has made no progress for %.0f s", name, heart.quiet)
        if heart.hangs:
            log.error("%s: %s", name, heart.end(sys._current_frames().get(thread)))
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(TimeUp))
            if not done.wait(END_TIMEOUT):
                os._exit(1)
