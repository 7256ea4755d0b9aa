"""The same answers from one process and from several, and no process left behind."""

import multiprocessing
import os

import pytest

from mjnav.errors import InvalidValue, MjnavError
from mjnav.study.workers import in_order


def square(x: int) -> tuple[int, int]:
    if x < 0:
        raise InvalidValue("x", x, "a number >= 0")
    return x * x, os.getpid()


def test_answers_come_in_the_order_of_the_tasks():
    here, there = list(in_order(square, range(6))), list(in_order(square, range(6), workers=2))
    assert [answer for answer, _ in here] == [answer for answer, _ in there] == [0, 1, 4, 9, 16, 25]
    assert {process for _, process in here} == {os.getpid()}
    assert os.getpid() not in {process for _, process in there}


def test_an_error_is_the_workers_own_and_ends_all():
    with pytest.raises(InvalidValue, match="x: found -1; allowed: a number >= 0"):
        list(in_order(square, [1, -1, 2], workers=2))
    assert multiprocessing.active_children() == []


def test_who_stops_listening_ends_the_workers():
    answers = in_order(square, range(1000), workers=2)
    assert next(answers)[0] == 0
    answers.close()
    assert multiprocessing.active_children() == []


def test_an_interrupt_ends_the_workers():
    answers = in_order(square, range(1000), workers=2)
    assert next(answers)[0] == 0
    with pytest.raises(KeyboardInterrupt):
        answers.throw(KeyboardInterrupt())
    assert multiprocessing.active_children() == []


def test_a_worker_that_is_killed_is_told_and_not_waited_for():
    with pytest.raises(MjnavError, match="a worker process was killed"):
        list(in_order(os._exit, [9, 9, 9], workers=2))
    assert multiprocessing.active_children() == []
