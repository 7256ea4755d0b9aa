import threading
import time
from contextlib import suppress

import pytest

from mjnav.recording.sink import FLUSH_INTERVAL, QUEUE_SIZE, DirectSink, Message, ThreadSink


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

    def add_message(self, *arguments):
        self.entered.set()
        self.go_on.wait()
        super().add_message(*arguments)


def batch(*sequences: int) -> list[Message]:
    return [Message(1, 0, sequence, b"") for sequence in sequences]


@pytest.fixture
def full():
    """A thread that is blocked in writing batch 0, and its queue full of the batches 1 .. QUEUE_SIZE."""
    writer, sink = BlockedWriter(), ThreadSink()
    sink.attach(writer)
    sink.put(batch(0), may_drop=True)
    writer.entered.wait()
    for number in range(1, QUEUE_SIZE + 1):
        sink.put(batch(number), may_drop=True)
    assert sink.dropped == 0
    yield sink, writer
    writer.go_on.set()
    sink.close()


def test_a_full_queue_drops_and_counts_what_may_be_dropped_and_keeps_the_rest_in_order(full):
    sink, writer = full
    for _ in range(5):
        sink.put(batch(-1, -2, -3), may_drop=True)
    assert sink.dropped == 5  # batches, not messages
    assert writer.added == []
    writer.go_on.set()
    sink.close()
    assert writer.added == list(range(QUEUE_SIZE + 1))
    assert sink.dropped == 5


def test_what_is_dropped_is_never_encoded(full):
    sink, _ = full
    encoded = []
    sink.put((encoded.append(1) or message for message in batch(-1)), may_drop=True)
    assert (sink.dropped, encoded) == (1, [])


def test_what_may_not_be_dropped_waits_for_its_place(full):
    sink, writer = full
    waiting = threading.Thread(target=sink.put, args=(batch(1000),))
    waiting.start()
    sink.put(batch(-1), may_drop=True)
    writer.go_on.set()
    waiting.join()
    sink.close()
    assert writer.added == [*range(QUEUE_SIZE + 1), 1000]
    assert sink.dropped == 1


def test_once_there_is_room_again_batches_are_taken_again(full):
    sink, writer = full
    sink.put(batch(-1), may_drop=True)
    writer.go_on.set()
    sink.put(batch(500))  # waits until the queue has room
    while len(writer.added) < QUEUE_SIZE + 2:
        time.sleep(0.001)
    sink.put(batch(501), may_drop=True)
    sink.close()
    assert writer.added == [*range(QUEUE_SIZE + 1), 500, 501]
    assert sink.dropped == 1


def test_an_error_ends_the_wait_for_a_place():
    class Full(BlockedWriter):
        def add_message(self, *arguments):
            super().add_message(*arguments)
            raise OSError(28, "No space left on device")

    writer, sink = Full(), ThreadSink()
    sink.attach(writer)
    for number in range(QUEUE_SIZE + 1):
        sink.put(batch(number))
    threading.Thread(target=writer.go_on.set).start()
    with suppress(OSError):  # where it is known by now
        sink.put(batch(-1))  # would wait for ever
    with pytest.raises(OSError, match="No space"):
        sink.close()


def test_a_direct_sink_drops_nothing():
    writer, sink = CountingWriter(), DirectSink()
    sink.attach(writer)
    for number in range(4 * QUEUE_SIZE):
        sink.put(batch(number), may_drop=True)
    assert writer.added == list(range(4 * QUEUE_SIZE))
    assert sink.dropped == 0


def test_what_was_handed_over_is_flushed_although_nothing_follows():
    writer = CountingWriter()
    thread = ThreadSink()
    thread.attach(writer)
    thread.put([Message(1, 0, 7, b"")])
    deadline = time.monotonic() + 20 * FLUSH_INTERVAL
    while not writer.flushes and time.monotonic() < deadline:
        time.sleep(0.01)
    thread.close()
    assert [count for _, count in writer.flushes] == [1]


def test_messages_keep_their_order_and_none_is_lost():
    writer = CountingWriter()
    thread = ThreadSink()
    thread.attach(writer)
    for i in range(500):
        thread.put([Message(1, 0, 2 * i, b""), Message(1, 0, 2 * i + 1, b"")])
    thread.close()
    assert writer.added == list(range(1000))


def broken():
    yield Message(1, 0, 0, b"")
    raise ZeroDivisionError


@pytest.mark.parametrize("kind", [DirectSink, ThreadSink])
def test_what_cannot_be_encoded_is_told_once_leaves_no_half_and_what_follows_is_written(kind):
    writer, sink = CountingWriter(), kind()
    sink.attach(writer)

    def put_and_wait():
        sink.put(broken())
        while True:  # until the thread has come to it
            sink.put([])
            time.sleep(0.001)

    with pytest.raises(ZeroDivisionError):
        put_and_wait()
    sink.put(batch(7, 8))
    sink.close()
    assert writer.added == [7, 8]


def test_what_cannot_be_encoded_at_the_end_is_told_at_the_end():
    thread = ThreadSink()
    thread.attach(CountingWriter())
    thread.put(broken())
    with pytest.raises(ZeroDivisionError):
        thread.close()


def test_a_direct_sink_writes_at_once_and_flushes_the_first_batch_and_then_when_that_is_due():
    writer = CountingWriter()
    sink = DirectSink()
    sink.attach(writer)
    assert (sink.due_in, sink.flushed_ns) == (None, None)
    sink.put(batch(7))
    assert [count for _, count in writer.flushes] == [1]
    assert (sink.due_in, sink.flushed_ns) == (None, 0)
    sink.put(batch(8))
    assert 0.0 < sink.due_in <= FLUSH_INTERVAL
    while sink.due_in > 0.0:
        time.sleep(0.01)
    sink.put(batch(9))
    assert [count for _, count in writer.flushes] == [1, 3]
    assert sink.due_in is None


def test_simulated_time_calls_for_a_flush_too_however_fast_it_goes():
    writer = CountingWriter()
    sink = DirectSink()
    sink.attach(writer)
    for tick in range(11):
        sink.put([Message(1, tick * 100_000_000, tick, b"")])
    assert [count for _, count in writer.flushes][:2] == [1, 3]
    assert len(writer.flushes) == 6  # one for the first tick, and one for every two
    assert sink.flushed_ns == 1_000_000_000


def test_a_direct_sink_raises_at_the_call_that_failed_and_writes_no_more():
    class Full(CountingWriter):
        def add_message(self, *_):
            raise OSError(28, "No space left on device")

    sink = DirectSink()
    sink.attach(Full())
    for _ in range(2):  # and at every one after it: the writer has lost its place
        with pytest.raises(OSError, match="No space"):
            sink.put([Message(1, 0, 0, b"")])
    with pytest.raises(OSError, match="No space"):
        sink.close()
