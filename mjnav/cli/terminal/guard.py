"""How a command ends: in order at the first signal, and reported by a parent process where it cannot report itself.

The process that the user started watches a child process, which does the work of the command.

A process that ends by os._exit, a fault in compiled code or the kernel's out-of-memory killer cannot report its end;
its parent can. The child is forked before anything is loaded, so that Python need not start again. The child has the
terminal and the process group of its parent, gets from it the signals that were sent to the parent alone, and ends
with it.
"""

import ctypes
import faulthandler
import os
import signal
import time
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager

from mjnav.cli.terminal.progress import tell
from mjnav.loop.supervision import Heartbeat, describe_end, supervised

# -------------------------------------------------------------------------------------------- signals


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


# ----------------------------------------------------------------------------------- parent and child


PASSED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_BY_THE_KERNEL = 0x80  # si_code of what a terminal sends to the whole process group, the child too
_PR_SET_PDEATHSIG = 1  # from <sys/prctl.h>
_DONE = b"the command has ended in order\n"


class Guard:
    """The connection of a command to the process that watches it: a file for its last words."""

    def __init__(self, descriptor: int | None = None):
        self._descriptor = descriptor

    @contextmanager
    def episode(self, name: str, limit: float) -> Iterator[Heartbeat]:
        """Runs an episode of this name on the main thread, with a limit of wall time [s]."""
        with supervised(limit, lambda text: tell(f"{name} {text}"), self._descriptor) as heart:
            yield heart

    def done(self) -> None:
        """Reports that the command has ended in order, whatever its exit code is."""
        if self._descriptor is not None:
            os.write(self._descriptor, _DONE)


def guarded(command: Callable[[Guard], int]) -> int:
    """Runs the command in a child and returns its exit code. Call it with one thread, before anything is loaded."""
    words = os.memfd_create("last words")
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    heard = {*PASSED_ON, signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, heard)
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
        faulthandler.enable(words, all_threads=False)  # type: ignore[arg-type] - a descriptor, as documented
        guard = Guard(words)
        try:
            return command(guard)
        finally:
            guard.done()
    while True:
        got = signal.sigwaitinfo(heard)
        if got.si_signo in PASSED_ON and got.si_code != _BY_THE_KERNEL:
            os.kill(child, got.si_signo)
        process, status = os.waitpid(child, os.WNOHANG)
        if process:
            return _ended(os.waitstatus_to_exitcode(status), words, before)


def _ended(code: int, words: int, before: Set[int]) -> int:
    """The exit code for a child that ended with `code`, after its last `words`."""
    if -code in PASSED_ON:  # on request: as the parent process expects it
        signal.signal(-code, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.raise_signal(-code)
    if code >= 0 and os.pread(words, len(_DONE), max(0, os.fstat(words).st_size - len(_DONE))) == _DONE:
        return code
    tell(describe_end("the process ended in the middle of its work", code, words))
    return 1
