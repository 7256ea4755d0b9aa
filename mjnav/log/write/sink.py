"""Sinks, through which encoded messages reach the file: written at once, or by a separate thread.

Without real time, writing at once is faster: a thread competes with the loop for the interpreter's lock. In real time
the thread keeps encoding, compression and the disk out of the tick, which it delays by 0.15 ms.
"""

import errno
import queue
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import NamedTuple

from mcap.writer import Writer

from mjnav.errors import said
from mjnav.log.live import LiveWriter

FLUSH_INTERVAL = 0.2  # [s] of wall time, and of simulated time, between which everything reaches the file
QUEUE_SIZE = 64  # batches, two a tick
STALL = 10.0  # [s] without progress of the log's thread, after which the disk counts as hung
_POLL = 0.001  # [s]
_FLUSH_NS = round(1e9 * FLUSH_INTERVAL)


class Message(NamedTuple):
    """One encoded message on its way to the file."""

    channel: int
    time_ns: int
    sequence: int
    data: bytes


class DirectSink:
    """Writes batches of messages at once, on the calling thread, and flushes at least every FLUSH_INTERVAL.

    A batch may be a generator. Its messages are then encoded by the sink, all of them before the first is written, so
    that a batch that cannot be encoded is not logged in part. The clock read here decides only when bytes reach the
    disk: a killed process loses what came after the last flush.
    """

    dropped = 0  # batches

    def __init__(self):
        self.flushed_ns: int | None = None  # simulated time of the latest message that a killed process leaves behind
        self.error: OSError | None = None  # the writer cannot be used any more
        self._writer: Writer | LiveWriter | None = None
        self._due: float | None = None  # when to flush; None while nothing was written since
        self._latest_ns = 0

    @property
    def due_in(self) -> float | None:
        """[s] until a flush is due; None where none is."""
        return None if self._due is None else max(0.0, self._due - time.monotonic())

    def attach(self, writer: Writer | LiveWriter) -> None:
        """Sets the writer of all later batches."""
        self._writer = writer

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """Writes messages; nothing is dropped, and an empty batch only flushes, if that is due.

        Raises OSError where writing failed, now or before: nothing more is written then.
        """
        if self.error is not None:
            raise self.error
        messages = list(batch)
        try:
            self._write(messages)
        except OSError as error:
            self.error = error
            raise

    def _write(self, messages: list[Message]) -> None:
        writer = self._writer
        assert writer is not None
        for channel, time_ns, sequence, data in messages:
            writer.add_message(channel, time_ns, data, time_ns, sequence)
            self._latest_ns = max(self._latest_ns, time_ns)
        now = time.monotonic()
        if self._due is None:
            self._due = now + FLUSH_INTERVAL
        if now >= self._due or self.flushed_ns is None or self._latest_ns - self.flushed_ns >= _FLUSH_NS:
            writer.flush()
            self.flushed_ns = self._latest_ns
            self._due = None

    def close(self) -> None:
        """Ends the writing; after that the caller may use the writer. Raises as `put`."""
        if self.error is not None:
            raise self.error


class ThreadSink:
    """A DirectSink on a separate thread, which starts here: before real-time scheduling, which it would inherit.

    A batch that `may_drop` is dropped, and counted in `dropped`, where the caller would have to wait. The thread hands
    its errors to the caller through a queue: each is raised once, in order. An error that ends the writing is raised at
    every call after those.
    """

    def __init__(self):
        self.dropped = 0
        self._sink = DirectSink()
        self._queue: queue.SimpleQueue[Iterable[Message] | None] = queue.SimpleQueue()
        self._faults: queue.SimpleQueue[Exception] = queue.SimpleQueue()
        self._taken = 0  # batches that the thread has finished
        self._thread = threading.Thread(target=self._run, name="mjnav-log", daemon=True)
        self._thread.start()

    @property
    def flushed_ns(self) -> int | None:
        """See `DirectSink`."""
        return self._sink.flushed_ns

    def attach(self, writer: Writer | LiveWriter) -> None:
        """See `DirectSink`."""
        self._sink.attach(writer)

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """Takes messages; where the disk cannot keep up, drops or waits, for at most STALL without progress."""
        if self._sink.error is not None:
            self._raise()
        if may_drop and self._queue.qsize() >= QUEUE_SIZE:
            self.dropped += 1
            return
        self._wait(lambda: self._queue.qsize() < QUEUE_SIZE)  # the lock of a bounded queue would delay every call
        self._queue.put(batch)
        self._raise()  # after the batch was taken: an earlier error must not lose it

    def close(self) -> None:
        """Writes all batches taken and ends the thread.

        Raises as `put`, and TimeoutError where the thread hangs; the writer is then still in its use.
        """
        if self._thread.is_alive():
            self._queue.put(None)
            self._wait(lambda: not self._thread.is_alive())
        self._raise()

    def _wait(self, done: Callable[[], bool]) -> None:
        """Waits until `done`. Raises TimeoutError where the thread finishes no batch for STALL."""
        taken, since = self._taken, time.monotonic()
        while not done():
            if self._taken != taken:
                taken, since = self._taken, time.monotonic()
            elif time.monotonic() - since > STALL:
                raise TimeoutError(errno.ETIMEDOUT, f"the disk took nothing for {STALL:g} s")
            time.sleep(_POLL)

    def _raise(self) -> None:
        with suppress(queue.Empty):
            raise self._faults.get_nowait()
        if self._sink.error is not None:
            raise self._sink.error

    def _run(self) -> None:
        while True:
            try:
                batch = self._queue.get(timeout=None if self._sink.error else self._sink.due_in)
            except queue.Empty:
                batch = ()
            if batch is None:
                return
            if self._sink.error is None:  # after an error batches are discarded, so that no caller waits
                try:
                    self._sink.put(batch)
                except Exception as error:  # raised again in the caller's thread
                    self._faults.put(error)
                except BaseException as error:  # SystemExit, or a panic of the live server: the thread continues
                    self._faults.put(RuntimeError(f"the log's thread: {said(error)}"))
            self._taken += 1
