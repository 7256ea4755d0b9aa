"""Where the trials of a sweep run: in processes of this machine, or on the workers of a Dask scheduler.

A scheduler takes trials as it has room for them, and yields their rows in the order in which they are done, or None
after a while without a row. Closing the generator ends the trials that are running.

`run_in_thread` runs a trial in a thread of a process that mjnav did not start, such as a Dask worker, watched by a
second thread. A tick that hangs in Python code is ended by an exception in its thread. Where that does not help, as in
compiled code that never returns, the process ends: Dask gives the trial to another worker,
`distributed.scheduler.allowed-failures` times. Code that hangs and holds the interpreter's lock also stops the worker's
heartbeat to Dask, which ends the worker after `distributed.scheduler.worker-ttl`.
"""

import ctypes
import logging
import os
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from mjnav.errors import InvalidValue, MjnavError, missing_extra
from mjnav.loop.supervision import END_TIMEOUT, MAX_SECONDS, STALL, Heartbeat, TimeUp, describe_fault
from mjnav.study.keep import LogFault
from mjnav.study.store.row import Row
from mjnav.study.sweep.workers import POLL, TimeLimit, as_done
from mjnav.study.trial import Trial, failed_row, run_trial

_POLL = 0.5  # [s]


def run_in_thread(trial: Trial, max_seconds: float) -> Row:
    """The trial's row, run on this thread; a failed row where it took longer than `max_seconds` of wall time."""
    with _watched(trial, max_seconds) as heart:
        row = run_trial(trial, beat=heart)
    return row if heart.over is None else failed_row(trial, heart.over, row.wall_s)


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


Rows = Generator[Row | None]
Scheduler = Callable[[Iterable[Trial]], Rows]

CONNECT_TIMEOUT = 10.0  # [s]
CLOSE_TIMEOUT = 2.0  # [s] for closing the connection
PATIENCE = 30.0  # [s] without an answer after which a scheduler is lost; its event loop may be busy for a while
WINDOW = 4  # trials submitted for each thread of the workers: while one runs, the next are sent
LEAST_WINDOW = 32  # trials submitted without any worker: an adaptive cluster grows with its load
DIED = "the worker died"


def local(workers: int, max_seconds: float = MAX_SECONDS, tell: Callable[[str], None] = lambda text: None) -> Scheduler:
    """In processes of this machine. `tell` gets a line about an episode that makes no progress."""
    limit = TimeLimit(lambda trial: trial.label, max_seconds, tell)

    def run(trials: Iterable[Trial]) -> Rows:
        for news in as_done(run_trial, trials, workers, given_up=failed_row, limit=limit):
            yield news and news[1]

    return run


def dask(address: str, max_seconds: float = MAX_SECONDS, *, patience: float = PATIENCE) -> Scheduler:
    """On the workers of the Dask scheduler at `address`; the trials of a worker that dies are given to others.

    Raises InputError where nothing answers at the address or distributed is not installed. The generator raises
    MjnavError where the scheduler is lost: the connection is closed, or there is no answer for `patience` [s].
    """
    _connect(address).close(timeout=CLOSE_TIMEOUT)

    def run(trials: Iterable[Trial]) -> Rows:
        source, done = iter(trials), SimpleQueue[Any]()
        under_way: dict[Any, Trial] = {}
        client = _connect(address)
        try:
            while True:
                threads = client.sync(client.scheduler.ncores, workers=None, callback_timeout=patience)
                window = max(LEAST_WINDOW, WINDOW * sum(threads.values()))
                for trial in islice(source, max(0, window - len(under_way))):
                    future = client.submit(run_in_thread, trial, max_seconds, key=f"mjnav-{trial.id}")
                    under_way[future] = trial
                    future.add_done_callback(done.put)
                if not under_way:
                    return
                try:
                    future = done.get(timeout=POLL)
                except Empty:
                    yield None
                    continue
                yield _row(future, under_way.pop(future))
        except TimeoutError:
            raise MjnavError(f"the scheduler at {address} is lost: no answer for {patience:g} s") from None
        except (OSError, CancelledError):
            raise MjnavError(f"the scheduler at {address} is lost: the connection was closed") from None
        finally:
            with suppress(Exception):  # the scheduler may be gone
                client.cancel(list(under_way))
                client.close(timeout=CLOSE_TIMEOUT)

    return run


def _row(future: Any, trial: Trial) -> Row:
    """The row of a trial that is done. Raises OSError or CancelledError where the scheduler is lost, and LogFault."""
    from distributed import KilledWorker

    if future.status != "error":
        return future.result()
    error = future.exception()
    if isinstance(error, LogFault):
        raise error
    return failed_row(trial, DIED if isinstance(error, KilledWorker) else describe_fault(error))


def _connect(address: str) -> Any:
    """The client of a scheduler. Raises InputError."""
    try:
        from distributed import Client
    except ImportError:
        raise missing_extra("distributed", "sweep") from None
    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in one line
    try:
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # the last two without certificates for tls://
        allowed = f"the address of a Dask scheduler, as in tcp://host:8786 ({error})"
        raise InvalidValue("", address, allowed, file="scheduler") from None
