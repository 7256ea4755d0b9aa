import time

import pytest

from mjnav.recording.log_thread import FLUSH_INTERVAL, LogThread, Message


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
    thread = LogThread()
    thread.attach(writer)
    thread.put([Message(1, 0, 7, b"")])
    deadline = time.monotonic() + 20 * FLUSH_INTERVAL
    while not writer.flushes and time.monotonic() < deadline:
        time.sleep(0.01)
    thread.close()
    assert [count for _, count in writer.flushes] == [1]


def test_messages_keep_their_order_and_none_is_lost():
    writer = CountingWriter()
    thread = LogThread()
    thread.attach(writer)
    for i in range(500):
        thread.put([Message(1, 0, 2 * i, b""), Message(1, 0, 2 * i + 1, b"")])
    thread.close()
    assert writer.added == list(range(1000))


def test_an_error_while_encoding_reaches_the_caller():
    def broken():
        yield Message(1, 0, 0, b"")
        raise ZeroDivisionError

    thread = LogThread()
    thread.attach(CountingWriter())
    thread.put(broken())
    with pytest.raises(ZeroDivisionError):
        thread.close()
    with pytest.raises(ZeroDivisionError):
        thread.put([])
