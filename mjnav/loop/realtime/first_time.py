"""Work that a process does only once and that should not happen in a tick: compiling or loading a kernel, importing."""

import builtins
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numba.core import event
from numpy.typing import NDArray

KERNELS = "numba:compiler_lock"  # held while a kernel is compiled, and while one is loaded from the cache


class FirstTimeWork(event.Listener):
    """Records when such work was done, on any thread."""

    def __init__(self):
        self._since: list[int] = []  # of what has begun and not ended
        self._done: list[tuple[int, int]] = []

    @property
    def intervals(self) -> NDArray[np.int64]:
        """(m, 2) begins and ends by CLOCK_MONOTONIC [ns], one within another where such work led to more of it."""
        return np.array(self._done, np.int64).reshape(-1, 2)

    def on_start(self, event: event.Event) -> None:
        """A kernel is about to be compiled or loaded."""
        self._since.append(time.perf_counter_ns())

    def on_end(self, event: event.Event) -> None:
        """It has been compiled or loaded."""
        if self._since:
            self.add(self._since.pop())

    def add(self, since: int) -> None:
        """Such work began at `since` [ns] and ends now."""
        self._done.append((since, time.perf_counter_ns()))


@contextmanager
def first_time_work() -> Iterator[FirstTimeWork]:
    """Records such work while the context lasts."""
    work, import_module = FirstTimeWork(), builtins.__import__

    def timed(*arguments, **options):
        since, loaded = time.perf_counter_ns(), len(sys.modules)
        try:
            return import_module(*arguments, **options)
        finally:
            if len(sys.modules) > loaded:
                work.add(since)

    builtins.__import__ = timed
    try:
        with event.install_listener(KERNELS, work):
            yield work
    finally:
        builtins.__import__ = import_module
