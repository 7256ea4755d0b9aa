"""What is said on standard error while a command works."""

import io
import sys

import pytest
from rich.progress import Progress

from mjnav.cli.waiting import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_in_a_pipe_nothing_is_said(capsys):
    with progress("hall", 60.0) as show:
        show(30.0)
    assert capsys.readouterr() == ("", "")


def test_on_a_terminal_it_says_what_is_done_without_making_the_caller_wait_for_the_drawing(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(Progress, "update", pytest.fail)  # takes the lock of the thread that draws
    with progress("hall", 60.0) as show:
        show(12.5)
    assert "hall" in terminal.getvalue()
    assert "12.5 of 60 s" in terminal.getvalue()
