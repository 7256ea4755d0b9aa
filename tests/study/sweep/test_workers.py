"""The same answers from one process and from several, and no process left behind."""

import multiprocessing
import os
import signal
from pathlib import Path

import pytest

from mjnav.errors import InvalidValue
from mjnav.study.sweep import schedulers
from mjnav.study.sweep.schedulers import ENVIRONMENT, TimeLimit, as_done

PATIENCE = 30.0  # [s]


LIMIT = TimeLimit(str, 60.0)


def answers(function, tasks):
    return as_done(function, tasks, 2, given_up=lambda task, cause: f"{task!r}: {cause}", limit=LIMIT)


def square(x: int, beat) -> tuple[int, int]:
    if x < 0:
        raise InvalidValue("x", x, "a number >= 0")
    return x * x, os.getpid()


def test_every_answer_comes_once_from_another_process():
    found = dict(filter(None, answers(square, range(6))))
    assert {number: answer for number, (answer, _) in found.items()} == {x: x * x for x in range(6)}
    assert os.getpid() not in {process for _, process in found.values()}


def test_an_error_is_the_workers_own_and_ends_all():
    with pytest.raises(InvalidValue, match="x: found -1; allowed: a number >= 0"):
        list(answers(square, [1, -1, 2]))
    assert multiprocessing.active_children() == []


def test_who_stops_listening_ends_the_workers():
    under_way = answers(square, range(1000))
    next(filter(None, under_way))
    under_way.close()
    assert multiprocessing.active_children() == []


def die_once(path: str, beat) -> str:
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
    found = dict(filter(None, answers(die_once, tasks)))
    assert found == {
        0: f"{once} done",
        1: "'': the worker died, 3 times: SIGKILL",
        2: f"{there} done",
        3: f"{there} done",
    }
    assert multiprocessing.active_children() == []


def memory(_: int, beat=None) -> tuple[str | None, str | None]:
    return os.environ.get("GLIBC_TUNABLES"), os.environ.get("PYTHONMALLOC")


@pytest.mark.parametrize(
    ("pages", "theirs"),
    [
        ("always [madvise] never", ("glibc.malloc.arena_max=3:glibc.malloc.hugetlb=1", "malloc")),
        ("always madvise [never]", ("glibc.malloc.arena_max=3", None)),
        (None, ("glibc.malloc.arena_max=3", None)),
    ],
)
def test_a_worker_asks_for_huge_pages_where_the_system_has_them(pages, theirs, tmp_path, monkeypatch):
    monkeypatch.setattr(schedulers, "HUGE_PAGES", tmp_path / "enabled")
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.malloc.arena_max=3")
    monkeypatch.delenv("PYTHONMALLOC", raising=False)
    if pages is not None:
        schedulers.HUGE_PAGES.write_text(pages)
    assert dict(filter(None, answers(memory, range(1)))) == {0: theirs}
    assert memory(0) == ("glibc.malloc.arena_max=3", None)


def threads(_: int, beat=None) -> list[str | None]:
    return [os.environ.get(name) for name in ENVIRONMENT]


def test_a_worker_computes_in_one_thread_and_we_in_as_many_as_before(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    before = threads(0)
    assert dict(filter(None, answers(threads, range(2)))) == dict.fromkeys(range(2), ["1"] * len(ENVIRONMENT))
    assert threads(0) == before
