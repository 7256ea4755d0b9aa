"""Ending a command in order at the first signal."""

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

AT_ONCE = 0.05  # [s] within which two signals count as one: `timeout` sends two, a guarded command may get two
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # Ctrl-C, `kill`, and a terminal that is closed


@contextmanager
def interruptible() -> Iterator[threading.Event]:
    """The first of SIGNALS sets the event, so that the command ends in order; the second ends the process.

    Signals that the process was started to ignore, as under nohup, stay ignored.
    """
    asked = threading.Event()
    first = 0.0

    def ask(number: int, frame: object) -> None:
        nonlocal first
        now = time.monotonic()
        first = first if asked.is_set() else now
        if asked.is_set() and now - first > AT_ONCE:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        asked.set()

    heeded = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, ask) for number in heeded}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
