"""The same answers from one process and from several, and no process left behind."""

import multiprocessing
import os
import signal
from pathlib import Path

import pytest

from mjnav.errors import InvalidValue
from mjnav.study.sweep.workers import ENVIRONMENT, as_done, in_order

PATIENCE = 30.0  # [s]


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


def die_once(path: str) -> str:
    """Dies where the file is not there yet, and leaves it."""
    if not path or not os.path.exists(path):
        if path:
            Path(path).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return f"{path} done"


def test_the_task_of_a_killed_worker_is_done_by_another_until_it_is_given_up(tmp_path):
    once, there = str(tmp_path / "once"), str(tmp_path / "there")
    Path(there).touch()
    tasks = [once, "", there, there]
    found = dict(filter(None, as_done(die_once, tasks, 2, given_up=lambda task, cause: f"{task!r}: {cause}")))
    assert found == {
        0: f"{once} done",
        1: "'': the worker died, 3 times: SIGKILL",
        2: f"{there} done",
        3: f"{there} done",
    }
    assert multiprocessing.active_children() == []


def threads(_: int) -> list[str | None]:
    return [os.environ.get(name) for name in ENVIRONMENT]


def test_a_worker_computes_in_one_thread_and_we_in_as_many_as_before(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    before = threads(0)
    assert list(in_order(threads, range(2), workers=2)) == [["1"] * len(ENVIRONMENT)] * 2
    assert threads(0) == before
