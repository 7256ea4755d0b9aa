"""Where the trials of a sweep run: in processes of this machine, or on the workers of a Dask scheduler.

A scheduler takes trials as it has room for them, and yields their rows in the order in which they are done, or None
after a while without a row. Closing the generator ends the trials that are running.

A worker of this machine is a fresh interpreter (a fork would copy the locks of our threads) with one compute thread. It
gets one task at a time through a pipe, so that the task of a worker that dies is known. Workers end with this process.
A task that hangs is reported, and ended when its time is up.

`run_in_thread` runs a trial in a thread of a process that mjnav did not start, such as a Dask worker, watched by a
second thread. A tick that hangs in Python code is ended by an exception in its thread. Where that does not help, as in
compiled code that never returns, the process ends: Dask gives the trial to another worker,
`distributed.scheduler.allowed-failures` times. Code that hangs and holds the interpreter's lock also stops the worker's
heartbeat to Dask, which ends the worker after `distributed.scheduler.worker-ttl`.
"""

import ctypes
import faulthandler
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing.connection import Connection, wait
from pathlib import Path
from queue import Empty, SimpleQueue
from types import MappingProxyType, ModuleType
from typing import Any, TypeVar

from mjnav.errors import InvalidValue, MjnavError, of_extra, said
from mjnav.loop import supervision
from mjnav.study.keep import LogFault
from mjnav.study.store import Row
from mjnav.study.trial import Trial, failed_row, run_trial

# ------------------------------------------------------------------------------------------ processes


Task = TypeVar("Task")
Answer = TypeVar("Answer")

POLL = 0.2  # [s] poll interval
DYING = 1.0  # [s] at most between the end of a worker's pipe and of its process
MAX_DEATHS = 3  # killed workers of one task, after which it has failed
KILLS = (signal.SIGKILL, signal.SIGTERM)  # by the kernel without memory, or by people; others come from the task
# Of workers: one compute thread, and no modules from the working folder.
ENVIRONMENT: Mapping[str, str] = MappingProxyType(
    dict.fromkeys(
        ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "PYTHONSAFEPATH"), "1"
    )
)
HUGE_PAGES = Path("/sys/kernel/mm/transparent_hugepage/enabled")


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """Wall time [s] that a task may take; its function calls its second argument, a `Heartbeat`.

    `tell` gets a line about a task that makes no progress, in which `name` is its name.
    """

    name: Callable[[Any], str]
    seconds: float = supervision.MAX_SECONDS
    tell: Callable[[str], None] = lambda text: None


def as_done(
    function: Callable[..., Answer],
    tasks: Iterable[Task],
    workers: int,
    *,
    given_up: Callable[[Task, str], Answer],
    limit: TimeLimit,
) -> Generator[tuple[int, Answer] | None]:
    """Each task's number and answer in the order in which they are done; None after POLL seconds without an answer.

    A task whose worker is killed is given to a new one. After MAX_DEATHS, or where the task itself ended the worker or
    took too long, the answer is `given_up(task, cause)`. Tasks are taken from `tasks` as they are needed. Closing the
    generator ends the workers. Raises what the function raises.
    """
    source = enumerate(tasks)
    deaths: Counter[int] = Counter()
    crew: dict[Connection, _Worker] = {}

    def join(number: int, task: Task) -> None:
        worker = _Worker(function, limit, number, task)
        crew[worker.pipe] = worker

    def leave(worker: _Worker) -> None:
        if crew.pop(worker.pipe, None) is not None:
            worker.end()

    try:
        for numbered in islice(source, workers):
            join(*numbered)
        while crew:
            ready: list[Any] = wait(list(crew), POLL)
            if not ready:
                yield None
            for worker in [*crew.values()]:
                number, task = worker.task
                try:
                    answer = worker.answer() if worker.pipe in ready else None
                    if answer is None:
                        continue
                except (EOFError, OSError):  # it died
                    deaths[number] += 1
                    killed, cause = worker.death(deaths[number])
                    leave(worker)
                    if killed and deaths[number] < MAX_DEATHS:
                        join(number, task)
                        continue
                    answer = False, given_up(task, cause)
                # First the next task: the caller may take long with this answer.
                following = next(source, None)
                if following is None:
                    leave(worker)
                elif worker.pipe in crew:
                    worker.give(*following)
                else:
                    join(*following)
                yield number, _opened(answer)
    finally:
        for worker in crew.values():
            worker.end()


class _Worker:
    """A process and the task that it has."""

    def __init__(self, function: Callable[..., Any], limit: TimeLimit, number: int, task: object):
        context = multiprocessing.get_context("spawn")
        self._limit = limit
        self.pipe, theirs = context.Pipe()
        self._words = os.memfd_create("last words")
        words = f"/proc/{os.getpid()}/fd/{self._words}"
        self._process = context.Process(target=_serve, args=(function, theirs, words, limit.seconds), daemon=True)
        with _environment():
            self._process.start()
        theirs.close()  # the worker has the only other end: when it dies, ours says so
        self.give(number, task)

    def give(self, number: int, task: object) -> None:
        """Gives a task to this idle worker."""
        self.task: tuple[int, Any] = number, task
        with suppress(BrokenPipeError, ConnectionResetError):  # it died; `answer` raises
            self.pipe.send(task)

    def answer(self) -> tuple[bool, Any] | None:
        """Whether the function raised, and its error or answer; None where the message is only news of the task.

        Raises EOFError or OSError where the process died.
        """
        answer = self.pipe.recv()
        if isinstance(answer, str):
            self._limit.tell(f"{self._limit.name(self.task[1])} {answer}")
            return None
        return answer

    def death(self, times: int) -> tuple[bool, str]:
        """Whether it was killed from outside, and how it died, for the `times`th time."""
        self._process.join(DYING)
        code, died = self._process.exitcode, "the worker died" + (f", {times} times" if times > 1 else "")
        if code is None:
            return False, f"{died}: its pipe broke"
        return -code in KILLS, supervision.describe_end(died, code, self._words, self._limit.seconds)

    def end(self) -> None:
        """Ends it at once."""
        self.pipe.close()
        os.close(self._words)
        self._process.kill()
        self._process.join()


def _opened(answer: tuple[bool, Any]) -> Any:
    raised, value = answer
    if raised:
        raise value
    return value


def _serve(function: Callable[..., Any], pipe: Connection, words: str, seconds: float) -> None:
    """The main function of a worker: tasks in, answers out, until the pipe or its parent ends.

    A stack that faulthandler writes goes to the file at `words`.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal interrupts all its processes; the parent ends this one
    descriptor = os.open(words, os.O_WRONLY | os.O_APPEND)
    faulthandler.enable(descriptor, all_threads=False)  # type: ignore[arg-type] - a descriptor, as documented
    threading.Thread(target=_die_with_parent, daemon=True).start()
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        try:
            with supervision.supervised(seconds, pipe.send, descriptor) as heart:
                answer = False, function(task, heart)
        except BaseException as error:  # of a plug-in
            answer = True, _sendable(error)
        pipe.send(answer)


def _die_with_parent() -> None:
    """Ends this process with its parent: one that is killed cannot end its workers."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _sendable(error: BaseException) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))
    except BaseException:
        return MjnavError(said(error))
    return error if isinstance(error, Exception) else MjnavError(said(error))


@contextmanager
def _environment() -> Iterator[None]:
    """Sets ENVIRONMENT and `_memory` for processes that start meanwhile; libraries and the interpreter read them then.

    The program that called is not imported again in them, as multiprocessing would: a script that calls `mjnav.sweep`
    needs no `if __name__ == "__main__"`.
    """
    environment = {**ENVIRONMENT, **_memory()}
    before = {name: os.environ.get(name) for name in environment}
    os.environ.update(environment)
    program = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = program
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _memory() -> Mapping[str, str]:
    """Asks for memory in pages of 2 MB, where Linux gives them: Python's own allocator would not.

    A tick touches many small objects all over memory. In a virtual machine, where a page takes two tables to look up, a
    tick of `hall` takes a sixteenth less so, and a seventh where one worker runs alone.
    """
    try:
        modes = HUGE_PAGES.read_text()
    except OSError:
        return {}
    if "[never]" in modes:
        return {}
    tunables = ":".join(filter(None, (os.environ.get("GLIBC_TUNABLES"), "glibc.malloc.hugetlb=1")))
    return {"GLIBC_TUNABLES": tunables, "PYTHONMALLOC": os.environ.get("PYTHONMALLOC", "malloc")}


# ----------------------------------------------------------------------------------------------- Dask


_POLL = 0.5  # [s]


def run_in_thread(trial: Trial, max_seconds: float) -> Row:
    """The trial's row, run on this thread; a failed row where it took longer than `max_seconds` of wall time."""
    heart, done = supervision.Heartbeat(max_seconds), threading.Event()
    threading.Thread(target=_watch, args=(trial.label, heart, threading.get_ident(), done), daemon=True).start()
    try:
        row = run_trial(trial, beat=heart)
    finally:
        done.set()
    return row if heart.over is None else failed_row(trial, heart.over, row.wall_s)


def _watch(name: str, heart: supervision.Heartbeat, thread: int, done: threading.Event) -> None:
    log, told = logging.getLogger("distributed.worker"), False
    while not done.wait(_POLL):
        if heart.quiet >= supervision.STALL and not told:
            told = True
            log.warning("%s has made no progress for %.0f s", name, heart.quiet)
        if heart.hangs:
            log.error("%s: %s", name, heart.end(sys._current_frames().get(thread)))
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(supervision.TimeUp))
            if not done.wait(supervision.END_TIMEOUT):
                os._exit(1)


Rows = Generator[Row | None]
Scheduler = Callable[[Iterable[Trial]], Rows]

CONNECT_TIMEOUT = 10.0  # [s]
CLOSE_TIMEOUT = 2.0  # [s] for closing the connection
PATIENCE = 30.0  # [s] without an answer after which a scheduler is lost; its event loop may be busy for a while
WINDOW = 4  # trials submitted for each thread of the workers: while one runs, the next are sent
LEAST_WINDOW = 32  # trials submitted without any worker: an adaptive cluster grows with its load
DIED = "the worker died"


def local(
    workers: int, max_seconds: float = supervision.MAX_SECONDS, tell: Callable[[str], None] = lambda text: None
) -> Scheduler:
    """In processes of this machine. `tell` gets a line about an episode that makes no progress."""
    limit = TimeLimit(lambda trial: trial.label, max_seconds, tell)

    def run(trials: Iterable[Trial]) -> Rows:
        for news in as_done(run_trial, trials, workers, given_up=failed_row, limit=limit):
            yield news and news[1]

    return run


def dask(address: str, max_seconds: float = supervision.MAX_SECONDS, *, patience: float = PATIENCE) -> Scheduler:
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
    return failed_row(trial, DIED if isinstance(error, KilledWorker) else supervision.describe_fault(error))


def _connect(address: str) -> Any:
    """The client of a scheduler. Raises InputError."""
    with of_extra("distributed", "sweep"):
        from distributed import Client
        from distributed.comm.addressing import parse_address, parse_host_port
    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in one line
    try:
        scheme, place = parse_address(address)
        if scheme in ("tcp", "tls"):
            parse_host_port(place)  # a client of an address without a port ends with a traceback
        return Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # the last two without certificates for tls://
        allowed = f"the address of a Dask scheduler, as in tcp://host:8786 ({error})"
        raise InvalidValue("", address, allowed, file="scheduler") from None
