"""What is said on standard error while a command works."""

import io
import sys
import time

import pytest
from numba import njit
from rich.progress import Progress

from mjnav.cli.terminal.progress import compile_notice, progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_compiling_is_told_once_and_only_where_something_is_compiled(capsys):
    kernel = njit(lambda x: x + 1)
    with compile_notice():
        kernel(1)
        kernel(1.0)
    assert capsys.readouterr().err == "mjnav: compiling for this machine; later runs start at once\n"
    with compile_notice():
        kernel(1)
    assert capsys.readouterr().err == ""


def test_a_terminal_shows_progress_without_delaying_the_caller(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(Progress, "update", pytest.fail)  # takes the lock of the thread that draws
    with progress("hall", 60.0) as show:
        show(12.5)
    assert "hall" in terminal.getvalue()
    assert "12.5 of 60 s" in terminal.getvalue()


def test_a_count_comes_with_its_rate_and_the_time_that_is_left(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with progress("small", 50, "episodes") as show:
        show(40)
        time.sleep(0.01)
        show(41)
    assert "41 of 50 episodes, " in terminal.getvalue()
    assert " a second, " in terminal.getvalue()
