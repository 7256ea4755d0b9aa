"""What is asked of the machine for real time is given back, and a machine that gives nothing is no error."""

import ctypes
import gc
import os

import pytest

from mjnav.loop.realtime import real_time


def asked_for() -> tuple:
    return os.sched_getscheduler(0), os.sched_getparam(0).sched_priority, os.sched_getaffinity(0)


def may_use_fifo() -> bool:
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except OSError:
        return False
    os.sched_setscheduler(0, *before)
    return True


def test_what_was_changed_is_restored_also_after_an_exception():
    before = asked_for()
    frozen = gc.get_freeze_count()
    with real_time() as got:
        assert set(got) == {"scheduler", "memory", "affinity"}
        assert gc.get_freeze_count() > frozen
    assert asked_for() == before
    assert gc.get_freeze_count() == 0
    with pytest.raises(ZeroDivisionError), real_time():
        _ = 1 / 0
    assert asked_for() == before


@pytest.mark.skipif(not may_use_fifo(), reason="this process may not use SCHED_FIFO")
def test_with_the_privilege_the_loop_runs_under_fifo():
    with real_time() as got:
        assert got["scheduler"] == "SCHED_FIFO 50"
        assert os.sched_getscheduler(0) == os.SCHED_FIFO


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="one CPU only")
def test_the_loop_stays_on_one_cpu():
    with real_time() as got:
        (cpu,) = os.sched_getaffinity(0)
        assert got["affinity"] == f"CPU {cpu}"


def test_without_any_privilege_it_goes_on_and_says_why(monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    class Libc:
        def mlockall(self, flags: int) -> int:
            ctypes.set_errno(12)
            return -1

        def munlockall(self) -> int:
            return -1

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(os, "sched_setaffinity", refuse)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Libc())
    with real_time() as got:
        assert got == {
            "scheduler": "SCHED_OTHER (SCHED_FIFO: Operation not permitted)",
            "memory": "not locked (Cannot allocate memory)",
            "affinity": "any (Operation not permitted)",
        }
