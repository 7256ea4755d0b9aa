"""Where encoded messages go on their way to the file: written at once, or by a thread of their own.

Headless, writing at once is quicker: 1.1 ms a tick in `hall` against 1.6 ms with a thread, which takes turns with the
loop for the interpreter's lock. In real time the thread keeps encoding, compression and the disk out of the tick, which
it holds up by 0.15 ms.
"""

import errno
import queue
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import NamedTuple, Protocol

from mjnav.recording.live import Writer

FLUSH_INTERVAL = 0.2  # [s] of wall time, and of simulated time, between which everything reaches the file
QUEUE_SIZE = 64  # batches, two a tick
STALL = 10.0  # [s] without any progress of the log's thread after which the disk counts as hung
_POLL = 0.001  # [s]
_FLUSH_NS = round(1e9 * FLUSH_INTERVAL)


class Message(NamedTuple):
    """One encoded message on its way to the file."""

    channel: int
    time_ns: int
    sequence: int
    data: bytes


class Sink(Protocol):
    """Takes batches of messages and flushes at least every FLUSH_INTERVAL.

    A batch may be a generator, and then its messages are encoded where they are written, all before the first of them
    is: what cannot be encoded is not in the log by half. The clock read here decides when bytes reach the disk and
    nothing else: a killed process loses what came after the last flush.
    """

    @property
    def dropped(self) -> int:
        """How many batches were."""
        ...

    @property
    def flushed_ns(self) -> int | None:
        """Simulated time of the latest message that a killed process would leave behind."""
        ...

    def attach(self, writer: Writer) -> None:
        """Writes with this writer what is put from now on."""
        ...

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """Takes messages.

        Raises OSError where writing failed, here or before: then nothing more is written. Raises once what else went
        wrong in encoding, here or before. A batch that `may_drop` is dropped and counted in `dropped` where taking it
        would hold the caller up.
        """
        ...

    def close(self) -> None:
        """Writes what was taken; the writer is the caller's again. Raises as `put`."""
        ...


class DirectSink:
    """Writes at once, on the calling thread."""

    dropped = 0

    def __init__(self):
        self.flushed_ns: int | None = None
        self.error: OSError | None = None  # the writer cannot be used any more
        self._writer: Writer | None = None
        self._due: float | None = None  # when to flush; None while nothing was written since
        self._latest_ns = 0

    @property
    def due_in(self) -> float | None:
        """[s] until a flush is due; None where none is."""
        return None if self._due is None else max(0.0, self._due - time.monotonic())

    def attach(self, writer: Writer) -> None:
        """See `Sink`."""
        self._writer = writer

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """See `Sink`; nothing is dropped, and an empty batch only flushes, if that is due."""
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
        """See `Sink`."""
        if self.error is not None:
            raise self.error


class ThreadSink:
    """Writes on a thread of its own, which starts here, before any real-time scheduling that it would inherit.

    What goes wrong there is handed to the caller through a queue: each fault once, in order, before what ended the
    writing is raised at every call.
    """

    def __init__(self):
        self.dropped = 0
        self._sink = DirectSink()
        self._queue: queue.SimpleQueue[Iterable[Message] | None] = queue.SimpleQueue()
        self._faults: queue.SimpleQueue[Exception] = queue.SimpleQueue()
        self._taken = 0  # batches that the thread is done with
        self._thread = threading.Thread(target=self._run, name="mjnav-log", daemon=True)
        self._thread.start()

    @property
    def flushed_ns(self) -> int | None:
        """See `Sink`."""
        return self._sink.flushed_ns

    def attach(self, writer: Writer) -> None:
        """See `Sink`."""
        self._sink.attach(writer)

    def put(self, batch: Iterable[Message], *, may_drop: bool = False) -> None:
        """See `Sink`; drops or waits where the disk cannot keep up, but for no more than STALL without any progress."""
        if self._sink.error is not None:
            self._raise()
        if may_drop and self._queue.qsize() >= QUEUE_SIZE:
            self.dropped += 1
            return
        self._wait(lambda: self._queue.qsize() < QUEUE_SIZE)  # a bounded queue's lock would hold up every call
        self._queue.put(batch)
        self._raise()  # what went wrong before is no reason to lose this

    def close(self) -> None:
        """See `Sink`; the thread ends. Raises TimeoutError where it is stuck: then the writer stays the thread's."""
        if self._thread.is_alive():
            self._queue.put(None)
            self._wait(lambda: not self._thread.is_alive())
        self._raise()

    def _wait(self, done: Callable[[], bool]) -> None:
        """Until `done`, as long as the thread is done with a batch every now and then."""
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
            if self._sink.error is None:  # after an error it takes nothing, but the caller must not wait for a place
                try:
                    self._sink.put(batch)
                except Exception as error:  # whatever it was, the simulation's thread shall raise it
                    self._faults.put(error)
                except BaseException as error:  # an exit, too, or a panic of the live server: this thread goes on
                    self._faults.put(RuntimeError(f"the log's thread: {error!r}"))
            self._taken += 1
