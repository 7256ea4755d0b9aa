"""What a command does with signals; what becomes of a run that they end stands in test_crash_safety.py."""

import io
import signal
import subprocess
import sys

import pytest

from mjnav.cli.terminal.guard import SIGNALS, interruptible
from mjnav.cli.terminal.progress import tell


def test_an_interrupt_before_the_run_is_one_line(mjnav, monkeypatch):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("mjnav.cli.run.load_scenario", interrupt)
    said = mjnav("run", "hall")
    assert (said.code, said.out, said.err) == (130, "", "mjnav: interrupted\n")


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


# A handler that waits for a lock that another one holds waits for ever: after 60 s the process says where, and ends.
BURSTS = """
import faulthandler, itertools, signal, sys
from mjnav.cli.terminal import guard as interrupt

def come(first, others, step):
    # The others come at this step of the first one's handler; returns whether it has as many steps.
    def trace(frame, event, arg):
        nonlocal step
        frame.f_trace_opcodes = True
        step -= 1
        for number in others if step == 0 else ():
            signal.raise_signal(number)
        return trace

    sys.settrace(trace)
    signal.raise_signal(first)
    sys.settrace(None)
    return step <= 0

tries = 0
interrupt.AT_ONCE = 60.0  # [s]; the machine may be busy
faulthandler.dump_traceback_later(60.0, exit=True)
for first, *others in (burst for size in (2, 3) for burst in itertools.product(interrupt.SIGNALS, repeat=size)):
    for step in itertools.count(1):
        with interrupt.interruptible() as asked:
            reached = come(first, others, step)
            assert asked()
        tries += 1
        if not reached:
            break
print(tries)
"""


def test_a_signal_at_any_step_of_another_ones_handler_blocks_nothing():
    done = subprocess.run([sys.executable, "-c", BURSTS], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 300


def test_what_nobody_can_read_is_not_told(monkeypatch):
    class Gone(io.StringIO):
        def write(self, text):
            raise BrokenPipeError

    for nowhere in (None, Gone()):  # as Python has it where standard error is closed, and a pipe without a reader
        monkeypatch.setattr(sys, "stderr", nowhere)
        tell("anything")
