"""Where encoded messages go on their way to the file: written at once, or by a thread of their own.

Headless, writing at once is quicker: 1.1 ms a tick in `hall` against 1.6 ms with a thread, which takes turns with the
loop for the interpreter's lock. In real time the thread keeps encoding, compression and the disk out of the tick, which
it holds up by 0.15 ms.
"""

import queue
import threading
import time
from collections.abc import Iterable
from typing import NamedTuple, Protocol

from mcap.writer import Writer

FLUSH_INTERVAL = 0.25  # [s] of wall time between which everything reaches the file
QUEUE_SIZE = 64  # batches, two a tick
_POLL = 0.001  # [s]


class Message(NamedTuple):
    """One encoded message on its way to the file."""

    channel: int
    time_ns: int
    sequence: int
    data: bytes


class Sink(Protocol):
    """Takes batches of messages and flushes at least every FLUSH_INTERVAL of wall time.

    A batch may be a generator, and then its messages are encoded where they are written. The clock read here decides
    when bytes reach the disk and nothing else: a killed process loses what came after the last flush.
    """

    dropped: int  # batches

    def attach(self, writer: Writer) -> None:
        """Writes with this writer what is put from now on."""
        ...

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """Takes messages. Raises what went wrong in writing, here or before.

        A batch that `may_drop` is dropped and counted in `dropped` where taking it would hold the caller up.
        """
        ...

    def close(self) -> None:
        """Writes what was taken; the writer is the caller's again. Raises as `put`."""
        ...


class DirectSink:
    """Writes at once, on the calling thread."""

    dropped = 0

    def __init__(self):
        self._writer: Writer | None = None
        self._due: float | None = None  # when to flush; None while nothing was written since

    @property
    def due_in(self) -> float | None:
        """[s] until a flush is due; None where none is."""
        return None if self._due is None else max(0.0, self._due - time.monotonic())

    def attach(self, writer: Writer) -> None:
        """See `Sink`."""
        self._writer = writer

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """See `Sink`; nothing is dropped, and an empty batch only flushes, if that is due."""
        writer = self._writer
        assert writer is not None
        for channel, time_ns, sequence, data in batch:
            writer.add_message(channel, time_ns, data, time_ns, sequence)
        now = time.monotonic()
        if self._due is None:
            self._due = now + FLUSH_INTERVAL
        elif now >= self._due:
            writer.flush()
            self._due = None

    def close(self) -> None:
        """See `Sink`."""


class ThreadSink:
    """Writes on a thread of its own, which starts here, before any real-time scheduling that it would inherit."""

    def __init__(self):
        self.dropped = 0
        self._sink = DirectSink()
        self._queue: queue.SimpleQueue[Iterable[Message] | None] = queue.SimpleQueue()
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._run, name="mjnav-log", daemon=True)
        self._thread.start()

    def attach(self, writer: Writer) -> None:
        """See `Sink`."""
        self._sink.attach(writer)

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """See `Sink`; drops or waits where the disk cannot keep up."""
        if self._error is not None:
            raise self._error
        if may_drop and self._queue.qsize() >= QUEUE_SIZE:
            self.dropped += 1
            return
        while self._queue.qsize() >= QUEUE_SIZE:  # a bounded queue's lock would hold up every call, not only these
            time.sleep(_POLL)
        self._queue.put(batch)

    def close(self) -> None:
        """See `Sink`; the thread ends."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        while True:
            try:
                batch = self._queue.get(timeout=None if self._error else self._sink.due_in)
            except queue.Empty:
                batch = ()
            if batch is None:
                return
            if self._error is not None:
                continue  # the caller must not wait for ever on a full queue
            try:
                self._sink.put(batch)
            except Exception as error:  # whatever it was, the simulation's thread shall raise it
                self._error = error
