"""Where the trials of a sweep run: here, in processes of this machine, or on the workers of a Dask scheduler.

Each takes trials one by one as it has room for them, and yields their rows as they are done, or None where nothing was
done for a while. Who stops listening ends what is running. `stop` is asked by what runs in this process.
"""

import logging
import socket
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any

from mjnav.errors import InvalidValue, MjnavError, missing_extra
from mjnav.loop.fault import describe_fault
from mjnav.loop.heartbeat import MAX_SECONDS, Heartbeat
from mjnav.study.in_thread import run_in_thread
from mjnav.study.row import Row
from mjnav.study.trial import Trial, failed_row, run_trial
from mjnav.study.workers import POLL, Limit, as_done

Rows = Generator[Row | None]
Scheduler = Callable[[Iterable[Trial], Callable[[], bool]], Rows]

CONNECT_TIMEOUT = 10.0  # [s]
WINDOW = 4  # trials under way for each thread of the workers: while one runs, the next are on their way
LEAST_WINDOW = 32  # trials where there is no worker yet: a cluster that grows with its load needs to see some
DIED = "the worker died"


def serial(trials: Iterable[Trial], stop: Callable[[], bool]) -> Rows:
    """In this process, one after another."""
    for trial in trials:
        row = run_trial(trial, stop)
        if stop():
            return
        yield row


def local(workers: int, max_seconds: float = MAX_SECONDS, tell: Callable[[str], None] = lambda text: None) -> Scheduler:
    """In processes of this machine. `tell` is told of an episode that makes no progress."""
    limit = Limit(lambda trial: trial.label, max_seconds, tell)

    def run(trials: Iterable[Trial], stop: Callable[[], bool]) -> Rows:
        for news in as_done(_run, trials, workers, given_up=failed_row, limit=limit):
            yield news and news[1]

    return run


def _run(trial: Trial, heart: Heartbeat) -> Row:
    return run_trial(trial, beat=heart)


def dask(address: str, max_seconds: float = MAX_SECONDS) -> Scheduler:
    """On the workers of the Dask scheduler at `address`; the trials of one that dies are given to others.

    Raises InputError where nobody answers at the address or distributed is missing; the rows raise MjnavError when the
    scheduler is gone.
    """
    _check_address(address)

    def run(trials: Iterable[Trial], stop: Callable[[], bool]) -> Rows:
        source, done = iter(trials), SimpleQueue[Any]()
        under_way: dict[Any, Trial] = {}
        client = _connect(address)
        try:
            window = _window(client)
            while True:
                for trial in islice(source, max(0, window - len(under_way))):
                    future = client.submit(run_in_thread, trial, max_seconds, key=f"mjnav-{trial.id}")
                    under_way[future] = trial
                    future.add_done_callback(done.put)
                if not under_way:
                    return
                try:
                    future = done.get(timeout=POLL)
                except Empty:
                    window = _window(client)
                    yield None
                    continue
                yield _row(future, under_way.pop(future), address)
        finally:
            with suppress(Exception):  # it may be gone
                client.cancel(list(under_way))
                client.close(timeout=CONNECT_TIMEOUT)

    return run


def _row(future: Any, trial: Trial, address: str) -> Row:
    from distributed import KilledWorker

    if future.status == "finished":
        return future.result()
    if future.status != "error":
        raise MjnavError(f"the scheduler at {address} is gone")
    error = future.exception()
    return failed_row(trial, DIED if isinstance(error, KilledWorker) else describe_fault(error))


def _check_address(address: str) -> None:
    try:
        from distributed.comm.addressing import parse_address, parse_host_port
    except ImportError:
        raise missing_extra("distributed", "sweep") from None
    try:
        host_and_port = parse_host_port(parse_address(address)[1])
        socket.create_connection(host_and_port, timeout=CONNECT_TIMEOUT).close()
    except (OSError, ValueError) as error:
        allowed = f"the address of a Dask scheduler, as in tcp://host:8786 ({error})"
        raise InvalidValue("--scheduler", address, allowed) from None


def _connect(address: str) -> Any:
    from distributed import Client

    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what goes wrong is told in a line
    try:
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except OSError as error:
        raise MjnavError(f"no Dask scheduler answers at {address}: {error}") from None


def _window(client: Any) -> int:
    """How many trials to have under way."""
    try:
        threads = sum(client.nthreads().values())
    except Exception:  # gone: the futures say so
        return 0
    return max(LEAST_WINDOW, WINDOW * threads)
