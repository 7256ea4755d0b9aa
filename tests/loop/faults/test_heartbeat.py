"""When an episode is named, asked to end and ended, by a clock that is read here."""

import os
import signal
import time

import pytest

from mjnav.loop.faults import heartbeat
from mjnav.loop.faults.heartbeat import END_TIMEOUT, STALL, START, Heartbeat, TimeUp, Watchdog, dumped_frames


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def asked():
    """How often this process was asked to end."""
    count = []
    before = signal.signal(heartbeat.ASK, lambda *_: count.append(1))
    yield count
    signal.signal(heartbeat.ASK, before)


@pytest.fixture
def seen(asked):
    """A watch of this process with a limit of 100 s, its clock, and what it tells."""
    clock, told = Clock(), []
    return Watchdog("crossing1, my:Hung, seed 4", 100.0, told.append, clock), clock, told


def test_an_episode_without_progress_is_named_once_until_it_goes_on(seen):
    watch, clock, told = seen
    watch.beat()
    for clock.now in (STALL - 1.0, STALL, STALL + 1.0):
        assert not watch.must_end(os.getpid())
    assert told == ["crossing1, my:Hung, seed 4 has made no progress for 60 s; it is ended in 40 s"]
    watch.beat()
    clock.now += STALL
    watch.must_end(os.getpid())
    assert len(told) == 2


def test_an_episode_that_has_not_begun_is_said_to_be_compiling(seen):
    watch, clock, told = seen
    clock.now = STALL
    watch.must_end(os.getpid())
    assert told == [
        "crossing1, my:Hung, seed 4 has not begun after 60 s (it may be compiling); it has 100 s, and 120 s to begin"
    ]


def test_what_hangs_beyond_its_time_is_asked_to_end_until_it_is_ended(seen, asked):
    watch, clock, _ = seen
    watch.beat()
    clock.now = 100.0
    assert not watch.must_end(os.getpid())
    assert asked == []  # not yet beyond its time
    clock.now = 100.1
    assert not watch.must_end(os.getpid())
    clock.now += END_TIMEOUT
    assert not watch.must_end(os.getpid())
    clock.now += 0.1
    assert watch.must_end(os.getpid())
    assert asked == [1, 1]  # not with its end: while a request is pending, another thread would say where it hangs


def test_what_still_goes_on_beyond_its_time_ends_by_itself(seen, asked):
    watch, clock, _ = seen
    for clock.now in range(0, 200, 2):
        watch.beat()
        assert not watch.must_end(os.getpid())
    assert asked == []


def test_until_the_first_tick_there_is_more_time(seen, asked):
    watch, clock, _ = seen
    clock.now = 100.0 + START
    assert not watch.must_end(os.getpid())
    assert asked == []
    clock.now += 0.1
    watch.must_end(os.getpid())
    assert asked == [1]


def test_a_heartbeat_ends_the_first_tick_after_its_time_and_all_later_ones():
    sent = []
    heart = Heartbeat(0.0, lambda: sent.append(1))
    heart()
    for _ in range(2):
        with pytest.raises(TimeUp, match="still running after 0 s"):
            heart()
    assert sent == [1]


def test_a_request_that_comes_too_early_is_not_the_last_and_one_that_was_heard_is(monkeypatch):
    monkeypatch.setattr(heartbeat, "GRACE", 0.05)
    with Heartbeat(0.0).on_signal() as heart:
        heart()
        signal.raise_signal(heartbeat.ASK)  # its last tick has just ended: the watch has not heard of it
        time.sleep(0.1)
        with pytest.raises(TimeUp, match="a tick hangs"):
            signal.raise_signal(heartbeat.ASK)
        signal.raise_signal(heartbeat.ASK)  # while it ends in order


def test_the_frames_of_a_dump_are_outermost_first():
    dump = 'Stack (most recent call first):\n  File "/a/b c.py", line 3 in f\n  File "/d.py", line 7 in <module>\n'
    assert [(f.filename, f.lineno, f.name) for f in dumped_frames(dump)] == [
        ("/d.py", 7, "<module>"),
        ("/a/b c.py", 3, "f"),
    ]
