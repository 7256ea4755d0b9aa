"""Ending a command in order at the first signal."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# [s] within which signals count as one: `timeout` sends two, and the process that guards a command passes on another
# one, late where the machine is busy.
AT_ONCE = 0.5
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)  # Ctrl-C, `kill`, and a terminal that is closed


@contextmanager
def interruptible() -> Iterator[Callable[[], bool]]:
    """Yields whether one of SIGNALS came, so that the command ends in order; a second one later ends the process.

    Signals that the process was started to ignore, as under nohup, stay ignored. The handler takes no lock, not even
    that of a threading.Event: a signal that comes while another one's handler holds it would wait for ever.
    """
    first: float | None = None

    def ask(number: int, frame: object) -> None:
        nonlocal first
        now = time.monotonic()
        if first is None:
            first = now
        elif now - first > AT_ONCE:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)

    heeded = [number for number in SIGNALS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, ask) for number in heeded}
    try:
        yield lambda: first is not None
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
