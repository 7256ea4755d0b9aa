"""What a command does with signals; what becomes of a run that they end stands in test_crash_safety.py."""

import io
import signal
import sys

import pytest

from mjnav.cli.terminal.guard import SIGNALS, interruptible
from mjnav.cli.terminal.progress import tell


@pytest.mark.parametrize("handled", SIGNALS)
def test_handlers_are_given_back_after_a_run(mjnav, handled):
    before = signal.getsignal(handled)
    assert mjnav("run", "crossing1", "--no-log", "--set", "time_limit=0.2").code == 0
    assert signal.getsignal(handled) is before


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
