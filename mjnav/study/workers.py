"""The same function over many tasks, here or in processes of their own.

A worker is a fresh interpreter (a fork would take our threads' locks with it) with one compute thread, at the other end
of a pipe, with one task at a time: whichever dies, it is known which task it had. It ends as soon as we do.
"""

import multiprocessing
import os
import pickle
import signal
import threading
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from itertools import islice
from multiprocessing.connection import Connection, wait
from types import MappingProxyType
from typing import Any, TypeVar

from mjnav.errors import MjnavError

Task = TypeVar("Task")
Answer = TypeVar("Answer")

POLL = 0.2  # [s] without news after which whoever listens is asked what to do
MAX_DEATHS = 3  # of workers at one task, before it is given up
# Of workers: one compute thread, and no module from the working folder but a named controller's.
ENVIRONMENT: Mapping[str, str] = MappingProxyType(
    dict.fromkeys(
        ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "PYTHONSAFEPATH"), "1"
    )
)


def in_order(function: Callable[[Task], Answer], tasks: Sequence[Task], workers: int = 1) -> Iterator[Answer]:
    """The answers in the tasks' order, as they come; with one worker, in this process.

    Whoever stops listening, or is interrupted, ends the workers. Raises what the function raises, and MjnavError where
    a task's workers were killed again and again.
    """
    if workers <= 1 or len(tasks) <= 1:
        yield from map(function, tasks)
        return
    early: dict[int, Answer] = {}
    following = 0
    with closing(as_done(function, tasks, workers, given_up=_refuse)) as news:
        for number, answer in filter(None, news):
            early[number] = answer
            while following in early:
                yield early.pop(following)
                following += 1


def as_done(
    function: Callable[[Task], Answer], tasks: Iterable[Task], workers: int, *, given_up: Callable[[Task], Answer]
) -> Generator[tuple[int, Answer] | None]:
    """Each task's number and answer, whichever is done first; None where nothing was for POLL seconds.

    A task whose worker dies is given to a new one; after MAX_DEATHS, `given_up` answers in its place. Tasks are taken
    from `tasks` as they are needed. Whoever stops listening ends the workers. Raises what the function raises.
    """
    source = enumerate(tasks)
    deaths: Counter[int] = Counter()
    crew: dict[Connection, _Worker] = {}

    def join(number: int, task: Task) -> None:
        worker = _Worker(function, number, task)
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
            for worker in [crew[pipe] for pipe in ready]:
                number, task = worker.task
                try:
                    answer = worker.answer()
                except (EOFError, OSError):  # it died
                    leave(worker)
                    deaths[number] += 1
                    if deaths[number] < MAX_DEATHS:
                        join(number, task)
                        continue
                    answer = False, given_up(task)
                # First the next task, for whoever listens may take its time.
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

    def __init__(self, function: Callable[[Any], Any], number: int, task: object):
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(function, theirs), daemon=True)
        with _environment():
            self._process.start()
        theirs.close()  # the worker has the only other end: when it dies, ours says so
        self.give(number, task)

    def give(self, number: int, task: object) -> None:
        """Gives it a task; it has none."""
        self.task: tuple[int, Any] = number, task
        with suppress(BrokenPipeError, ConnectionResetError):  # it died, which asking for its answer tells
            self.pipe.send(task)

    def answer(self) -> tuple[bool, Any]:
        """Whether the function raised, and what, or its answer. Raises EOFError or OSError where the process died."""
        return self.pipe.recv()

    def end(self) -> None:
        """Ends it at once."""
        self.pipe.close()
        self._process.kill()
        self._process.join()


def _opened(answer: tuple[bool, Any]) -> Any:
    raised, value = answer
    if raised:
        raise value
    return value


def _serve(function: Callable[[Any], Any], pipe: Connection) -> None:
    """A worker's life: tasks in, answers out, until the pipe or its parent ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal interrupts all its processes; our parent ends us
    threading.Thread(target=_die_with_parent, daemon=True).start()
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        try:
            answer = False, function(task)
        except Exception as error:
            answer = True, _sendable(error)
        pipe.send(answer)


def _die_with_parent() -> None:
    """A parent that is killed can end nobody."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _sendable(error: Exception) -> Exception:
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return MjnavError(repr(error))
    return error


def _refuse(task: object) -> Any:
    raise MjnavError("a worker process was killed, perhaps for want of memory: fewer workers may do")


@contextmanager
def _environment() -> Iterator[None]:
    """What processes that start meanwhile find: libraries and the interpreter read it when they start."""
    before = {name: os.environ.get(name) for name in ENVIRONMENT}
    os.environ.update(ENVIRONMENT)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
