import time

import pytest

from mjnav.recording.sink import FLUSH_INTERVAL, DirectSink, Message, ThreadSink


class CountingWriter:
    """Counts what a log's thread does, without a file."""

    def __init__(self):
        self.added, self.flushes = [], []

    def add_message(self, channel, time_ns, data, publish_time, sequence):
        self.added.append(sequence)

    def flush(self):
        self.flushes.append((time.monotonic(), len(self.added)))


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


def test_an_error_while_encoding_reaches_the_caller():
    def broken():
        yield Message(1, 0, 0, b"")
        raise ZeroDivisionError

    thread = ThreadSink()
    thread.attach(CountingWriter())
    thread.put(broken())
    with pytest.raises(ZeroDivisionError):
        thread.close()
    with pytest.raises(ZeroDivisionError):
        thread.put([])


def test_a_direct_sink_writes_at_once_and_flushes_when_that_is_due():
    writer = CountingWriter()
    sink = DirectSink()
    sink.attach(writer)
    assert sink.due_in is None
    sink.put([Message(1, 0, 7, b"")])
    assert writer.added == [7]
    assert not writer.flushes
    assert 0.0 < sink.due_in <= FLUSH_INTERVAL
    while sink.due_in > 0.0:
        time.sleep(0.01)
    sink.put([Message(1, 0, 8, b"")])
    assert [count for _, count in writer.flushes] == [2]
    assert sink.due_in is None


def test_a_direct_sink_raises_at_the_call_that_failed():
    class Full(CountingWriter):
        def add_message(self, *_):
            raise OSError(28, "No space left on device")

    sink = DirectSink()
    sink.attach(Full())
    with pytest.raises(OSError, match="No space"):
        sink.put([Message(1, 0, 0, b"")])
