"""The same function over many tasks in worker processes.

A worker is a fresh interpreter (a fork would copy the locks of our threads) with one compute thread. It gets one task
at a time through a pipe, so that the task of a worker that dies is known. Workers end with this process. A task
that hangs is reported, and ended when its time is up.
"""

import faulthandler
import multiprocessing
import os
import pickle
import signal
import sys
import threading
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing.connection import Connection, wait
from types import MappingProxyType, ModuleType
from typing import Any, TypeVar

from mjnav.errors import MjnavError, said
from mjnav.loop.supervision import MAX_SECONDS, describe_end, supervised

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


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """Wall time [s] that a task may take; its function calls its second argument, a `Heartbeat`.

    `tell` gets a line about a task that makes no progress, in which `name` is its name.
    """

    name: Callable[[Any], str]
    seconds: float = MAX_SECONDS
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
        return -code in KILLS, describe_end(died, code, self._words, self._limit.seconds)

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
            with supervised(seconds, pipe.send, descriptor) as heart:
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
    """Sets ENVIRONMENT for processes that start meanwhile; libraries and the interpreter read it at their start.

    The program that called is not imported again in them, as multiprocessing would: a script that calls `mjnav.sweep`
    needs no `if __name__ == "__main__"`.
    """
    before = {name: os.environ.get(name) for name in ENVIRONMENT}
    os.environ.update(ENVIRONMENT)
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
