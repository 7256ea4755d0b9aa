import sys
import threading
import time
from contextlib import suppress

import pytest

from mjnav.log.write import sink as module
from mjnav.log.write.sink import FLUSH_INTERVAL, QUEUE_SIZE, DirectSink, Message, ThreadSink


class CountingWriter:
    """Counts what a log's thread does, without a file."""

    def __init__(self):
        self.added, self.flushes = [], []

    def add_message(self, channel, time_ns, data, publish_time, sequence):
        self.added.append(sequence)

    def flush(self):
        self.flushes.append((time.monotonic(), len(self.added)))


class BlockedWriter(CountingWriter):
    """Writes nothing until it may go on."""

    def __init__(self):
        super().__init__()
        self.entered, self.go_on = threading.Event(), threading.Event()

    def add_message(self, channel, time_ns, data, publish_time, sequence):
        self.entered.set()
        self.go_on.wait()
        super().add_message(channel, time_ns, data, publish_time, sequence)


def attached(sink, writer):
    sink.attach(writer)
    return writer, sink


def batch(*sequences: int) -> list[Message]:
    return [Message(1, 0, sequence, b"") for sequence in sequences]


@pytest.fixture
def full():
    """A thread that is blocked in writing batch 0, and its queue full of the batches 1 .. QUEUE_SIZE."""
    writer, sink = attached(ThreadSink(), BlockedWriter())
    sink.put(batch(0), may_drop=True)
    writer.entered.wait()
    for number in range(1, QUEUE_SIZE + 1):
        sink.put(batch(number), may_drop=True)
    assert sink.dropped == 0
    yield sink, writer
    writer.go_on.set()
    sink.close()


def test_a_full_queue_drops_and_counts_what_may_go_and_keeps_the_rest(full):
    sink, writer = full
    encoded = []
    for _ in range(5):
        sink.put((encoded.append(message) or message for message in batch(-1, -2, -3)), may_drop=True)
    assert sink.dropped == 5  # batches, not messages
    assert writer.added == encoded == []
    writer.go_on.set()
    sink.close()
    assert writer.added == list(range(QUEUE_SIZE + 1))
    assert sink.dropped == 5


def raising(error: BaseException):
    yield Message(1, 0, 0, b"")
    raise error


@pytest.mark.parametrize("kind", [DirectSink, ThreadSink])
def test_what_cannot_be_encoded_is_told_once_and_the_rest_is_written(kind):
    writer, sink = attached(kind(), CountingWriter())

    def put_and_wait():
        sink.put(raising(ZeroDivisionError()))
        while True:  # until the thread has come to it
            sink.put([])
            time.sleep(0.001)

    with pytest.raises(ZeroDivisionError):
        put_and_wait()
    sink.put(batch(7, 8))
    sink.close()
    assert writer.added == [7, 8]


# ------------------------------------------------------------------ the thread's faults, handed over


def told(call) -> list[str]:
    """What the call raises, until it raises nothing."""
    found = []
    while True:
        try:
            call()
        except Exception as error:
            found.append(str(error))
        else:
            return found


def test_no_fault_is_lost_however_the_threads_take_turns():
    before, found, num = sys.getswitchinterval(), [], 2000
    _, thread = attached(ThreadSink(), CountingWriter())
    sys.setswitchinterval(1e-6)
    try:
        for number in range(num):
            try:
                thread.put(raising(ValueError(str(number))))
            except ValueError as error:
                found.append(str(error))
    finally:
        sys.setswitchinterval(before)
    assert found + told(thread.close) == [str(number) for number in range(num)]


@pytest.mark.parametrize("error", [SystemExit(7), KeyboardInterrupt(), GeneratorExit()])
def test_an_exit_in_encoding_is_told_and_ends_neither_the_thread_nor_the_log(error):
    writer, thread = attached(ThreadSink(), CountingWriter())
    thread.put(raising(error))
    for number in range(3 * QUEUE_SIZE):  # more than the queue of a thread that is gone takes
        with suppress(RuntimeError):
            thread.put(batch(number))
    told(thread.close)
    assert writer.added == list(range(3 * QUEUE_SIZE))


def test_a_disk_that_hangs_is_told_in_time(full, monkeypatch):
    sink, writer = full
    monkeypatch.setattr(module, "STALL", 0.2)
    for call in (lambda: sink.put(batch(1000)), sink.close):
        with pytest.raises(TimeoutError, match=r"the disk took nothing for 0\.2 s"):
            call()
    writer.go_on.set()
    while sink._thread.is_alive():
        time.sleep(0.001)
    assert writer.added == list(range(QUEUE_SIZE + 1))


def test_a_direct_sink_writes_at_once_and_flushes_when_due():
    writer, sink = attached(DirectSink(), CountingWriter())
    assert (sink.due_in, sink.flushed_ns) == (None, None)
    sink.put(batch(7))
    assert [count for _, count in writer.flushes] == [1]
    assert (sink.due_in, sink.flushed_ns) == (None, 0)
    sink.put(batch(8))
    assert sink.due_in is not None
    assert 0.0 < sink.due_in <= FLUSH_INTERVAL
    while sink.due_in > 0.0:
        time.sleep(0.01)
    sink.put(batch(9))
    assert [count for _, count in writer.flushes] == [1, 3]
    assert sink.due_in is None


def test_simulated_time_calls_for_a_flush_too_however_fast_it_goes():
    writer, sink = attached(DirectSink(), CountingWriter())
    for tick in range(11):
        sink.put([Message(1, tick * 100_000_000, tick, b"")])
    assert [count for _, count in writer.flushes][:2] == [1, 3]
    assert len(writer.flushes) == 6  # one for the first tick, and one for every two
    assert sink.flushed_ns == 1_000_000_000
