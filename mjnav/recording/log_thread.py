"""The thread that encodes and writes, so that neither encoding nor compression nor the disk holds up a tick.

Physics releases the interpreter's lock while it steps, and this thread works meanwhile: with 2 ms of physics a tick, a
tick's write holds up the loop by 0.04 ms in place of 0.5 to 0.9 ms.
"""

import queue
import threading
import time
from collections.abc import Iterable
from typing import NamedTuple

from mcap.writer import Writer

FLUSH_INTERVAL = 0.25  # [s] of wall time between which everything reaches the file
_QUEUE_SIZE = 64  # batches, two a tick; a full queue holds the caller back, and nothing is dropped
_POLL = 0.001  # [s]


class Message(NamedTuple):
    """One encoded message on its way to the file."""

    channel: int
    time_ns: int
    sequence: int
    data: bytes


class LogThread:
    """Takes batches of messages and flushes at least every FLUSH_INTERVAL of wall time.

    A batch may be a generator, and then its messages are encoded here.

    The clock read here decides when bytes reach the disk and nothing else. A killed process loses what came after the
    last flush. An error is raised by every call that follows. The thread starts here, before any real-time scheduling
    that it would inherit, and the writer may come later.
    """

    def __init__(self):
        self._writer: Writer | None = None
        self._queue: queue.SimpleQueue[Iterable[Message] | None] = queue.SimpleQueue()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="mjnav-log", daemon=True)
        self._thread.start()

    def attach(self, writer: Writer) -> None:
        """Writes with this writer what is put from now on."""
        self._writer = writer

    def put(self, batch: Iterable[Message]) -> None:
        """Hands over messages; waits only where the disk cannot keep up. Raises what went wrong before."""
        if self._error is not None:
            raise self._error
        while self._queue.qsize() >= _QUEUE_SIZE:  # a bounded queue's lock would hold up every call, not only these
            time.sleep(_POLL)
        self._queue.put(batch)

    def close(self) -> None:
        """Writes what was handed over and ends the thread; the writer is the caller's again. Raises as `put`."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        deadline = None  # no flush is due while nothing was written
        while True:
            wait = None if deadline is None else max(0.0, deadline - time.monotonic())
            try:
                batch = self._queue.get(timeout=wait)
            except queue.Empty:
                batch = ()
            if batch is None:
                return
            if self._error is not None:
                continue  # the caller must not wait for ever on a full queue
            try:
                assert self._writer is not None
                for channel, time_ns, sequence, data in batch:
                    self._writer.add_message(channel, time_ns, data, time_ns, sequence)
                if deadline is None:
                    deadline = time.monotonic() + FLUSH_INTERVAL
                elif time.monotonic() >= deadline:
                    self._writer.flush()
                    deadline = None
            except Exception as error:  # whatever it was, the simulation's thread shall raise it
                self._error = error
                deadline = None
