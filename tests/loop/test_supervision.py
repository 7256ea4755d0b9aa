"""What is told of a run that broke, and what ends one that takes too long."""

import json
import time
import traceback

import numpy as np
import pytest

from mjnav.errors import MjnavError
from mjnav.loop import supervision
from mjnav.loop.supervision import Heartbeat, TimeUp, describe_fault, fault_events, location, supervised


def raised(call) -> Exception:
    with pytest.raises(Exception) as caught:  # noqa: PT011
        call()
    return caught.value


def test_the_place_is_the_users_own_line_not_the_librarys_below_it():
    for call in (lambda: json.loads("{"), lambda: np.zeros((2, 2)) @ np.zeros(3)):
        where = location(traceback.extract_tb(raised(call).__traceback__))
        assert where.startswith(f"{__file__}:{call.__code__.co_firstlineno}, in ")


def test_mjnavs_own_words_stand_for_themselves():
    error = raised(lambda: (_ for _ in ()).throw(MjnavError("the disk is full")))
    assert describe_fault(error) == "the disk is full"
    assert [event.name for event in fault_events(error)] == ["fault"]
    assert [event.name for event in fault_events(raised(lambda: 1 // 0))] == ["fault", "traceback"]


def test_a_heartbeat_ends_the_first_tick_after_its_time_and_all_later_ones():
    heart = Heartbeat(0.0)
    heart()
    for _ in range(2):
        with pytest.raises(TimeUp, match="still running after 0 s"):
            heart()


def hang():
    while True:
        pass


def test_an_episode_without_progress_is_named_once_and_ended_where_it_hangs(monkeypatch):
    for name, value in {"INTERVAL": 0.01, "STALL": 0.05, "GRACE": 0.2}.items():
        monkeypatch.setattr(supervision, name, value)
    told = []
    with supervised(0.0, told.append) as heart:
        heart()
        with pytest.raises(TimeUp, match=rf"a tick hangs \({__file__}:\d+, in hang"):
            hang()
        time.sleep(0.05)  # while it ends in order, it is not ended again
    assert told == ["has made no progress for 0 s; it is ended in 0 s"]
