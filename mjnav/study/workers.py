"""The same function over many tasks, here or in processes of their own."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from mjnav.errors import MjnavError

Task = TypeVar("Task")
Answer = TypeVar("Answer")


def in_order(function: Callable[[Task], Answer], tasks: Sequence[Task], workers: int = 1) -> Iterator[Answer]:
    """The answers in the tasks' order, as they come; with one worker, in this process.

    Whoever stops listening, or is interrupted, ends the workers. Raises what the function raises, and MjnavError where
    a worker was killed.
    """
    if workers <= 1 or len(tasks) <= 1:
        yield from map(function, tasks)
        return
    before = set(multiprocessing.active_children())
    # A fresh interpreter each: a fork would take our threads' locks with it.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(tasks)), mp_context=context, initializer=_ignore_interrupts) as pool:
        try:
            # No map: it cancels what is pending, and the pool trips over that when its workers end.
            for future in [pool.submit(function, task) for task in tasks]:
                yield future.result()
        except BrokenProcessPool:
            raise MjnavError("a worker process was killed, perhaps for want of memory: fewer workers may do") from None
        except BaseException:
            for process in set(multiprocessing.active_children()) - before:
                process.terminate()
            raise


def _ignore_interrupts() -> None:
    """A terminal interrupts all its processes; the one that started us ends us."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
