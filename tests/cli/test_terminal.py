"""Progress, signals and tables: a row is a line in a pipe, and fits a terminal."""

import io
import signal
import sys
import time

import pytest
from numba import njit
from rich.progress import Progress

from mjnav.cli import terminal
from mjnav.cli.terminal import SIGNALS, compile_notice, interruptible, progress, tell

PATIENCE = 60.0  # [s] for a process on a busy machine


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


@pytest.mark.parametrize("handled", SIGNALS)
def test_handlers_are_given_back_after_a_run(mjnav, handled):
    before = signal.getsignal(handled)
    assert mjnav("run", "crossing1", "--no-log", "--set", "time_limit=0.2").code == 0
    assert signal.getsignal(handled) is before


@pytest.mark.parametrize("number", SIGNALS)
def test_a_command_is_interrupted_in_order_before_it_asks_for_signals_too(start, tmp_path, number):
    (tmp_path / "slow.py").write_text("import time\nopen('begun', 'x').close()\ntime.sleep(60.0)\n")
    process = start("run", "crossing1", "--no-log", "--controller", "slow.py:Slow")
    ends = time.monotonic() + PATIENCE
    while not (tmp_path / "begun").exists():
        assert time.monotonic() < ends, "the module was not imported"
        time.sleep(0.01)
    process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, err) == (130, "", "mjnav: interrupted\n")


def test_what_is_ignored_from_the_start_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with interruptible() as asked:
            signal.raise_signal(signal.SIGHUP)
            assert not asked()
            signal.raise_signal(signal.SIGTERM)
            assert asked()
    finally:
        signal.signal(signal.SIGHUP, before)


def test_what_nobody_can_read_is_not_told(monkeypatch):
    class Gone(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    for nowhere in (None, Gone()):  # as Python has it where standard error is closed, and a pipe without a reader
        monkeypatch.setattr(sys, "stderr", nowhere)
        tell("anything")


HEADS = ("topic", "what", "Hz", "share")
ROWS = [
    ("/belief/robot", "the particles of the robot, with their weights", "12345.678", "17.4%"),
    ("/tf", "", "10.00", "0.1%"),
]


@pytest.mark.parametrize("columns", [60, 80, 120, 200])
def test_a_table_fits_the_terminal_and_breaks_no_number(monkeypatch, capsys, columns):
    made = terminal.console
    monkeypatch.setattr(terminal, "console", lambda **_: made(width=columns))
    monkeypatch.setattr(terminal, "on_terminal", lambda: True)
    terminal.print_table(ROWS, HEADS, numbers=(2, 3))
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= columns
    words = out.replace(",", " ").split()
    for row in ROWS:
        assert {*row[0].split(), *row[1].replace(",", " ").split(), *row[2:]} <= {*words}


def test_in_a_pipe_a_row_is_a_line(capsys):
    terminal.print_table([("x" * 300, "word " * 60 + "end", "1.5", "2.5")], HEADS, numbers=(2, 3))
    assert len(capsys.readouterr().out.splitlines()) == 2
