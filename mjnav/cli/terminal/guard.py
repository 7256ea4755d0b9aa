"""How a command ends: in order at the first signal, and reported by a parent process where it cannot report itself.

The process that the user started watches a child process, which does the work of the command.

A process that ends by os._exit, a fault in compiled code or the kernel's out-of-memory killer cannot report its end;
its parent can. The child is forked before anything is loaded, so that Python need not start again. The child has the
terminal and the process group of its parent, gets from it the signals that were sent to the parent alone, and ends
with it.
"""

import ctypes
import fcntl
import os
import signal
import time
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager, suppress

from mjnav.cli.terminal.progress import tell
from mjnav.loop.faults.heartbeat import (
    ASK,
    Heartbeat,
    Watchdog,
    describe_end,
    dump_of,
    dump_to,
    dumped_frames,
    read_dump,
)

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
LOOK = 0.5  # [s] poll interval
_BY_THE_KERNEL = 0x80  # si_code of what a terminal sends to the whole process group, the child too
_PR_SET_PDEATHSIG = 1  # from <sys/prctl.h>
_EPISODE, _BEAT, _REST, _DONE = b"episode", b"beat", b"rest", b"done"


class Guard:
    """The connection of a command to the process that watches it; without a descriptor, messages are dropped."""

    def __init__(self, descriptor: int | None = None):
        self._descriptor = descriptor

    @contextmanager
    def episode(self, name: str, limit: float) -> Iterator[Heartbeat]:
        """Runs an episode of this name on the main thread, with a limit of wall time [s]."""
        self._send(_EPISODE, repr(limit).encode(), " ".join(name.split()).encode())
        try:
            with Heartbeat(limit, lambda: self._send(_BEAT)).on_signal() as heart:
                yield heart
        finally:
            self._send(_REST)

    def done(self) -> None:
        """Reports that the command has ended in order, whatever its exit code is."""
        self._send(_DONE)

    def _send(self, *words: bytes) -> None:
        if self._descriptor is not None:
            os.write(self._descriptor, b" ".join(words) + b"\n")


def guarded(command: Callable[[Guard], int]) -> int:
    """Runs the command in a child and returns its exit code. Call it with one thread, before anything is loaded."""
    (news, our_news), (words, our_words) = os.pipe(), os.pipe()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    heard = {*PASSED_ON, signal.SIGCHLD}
    before = signal.pthread_sigmask(signal.SIG_BLOCK, heard)
    parent = os.getpid()
    child = os.fork()
    if child == 0:
        os.close(news)
        os.close(words)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        signal.signal(ASK, signal.SIG_IGN)  # without an episode
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os._exit(1)
        dump_to(our_words)
        guard = Guard(our_news)
        try:
            return command(guard)
        finally:
            guard.done()
    os.close(our_news)
    os.close(our_words)
    return _Child(child, news, words).follow(heard, before)


class _Child:
    """The child, seen from its parent."""

    def __init__(self, process: int, news: int, words: int):
        self._process, self._news, self._words = process, news, words
        fcntl.fcntl(news, fcntl.F_SETFL, os.O_NONBLOCK)
        self._rest = b""
        self._watch: Watchdog | None = None
        self._done = False
        self._cause: str | None = None  # why it was ended

    def follow(self, heard: Set[int], before: Set[int]) -> int:
        """Its exit code, when it has ended."""
        while True:
            got = signal.sigtimedwait(heard, LOOK)
            # In PASSED_ON: Python makes signal 0 of a wait that was stopped and continued beyond its time.
            if got is not None and got.si_signo in PASSED_ON and got.si_code != _BY_THE_KERNEL:
                os.kill(self._process, got.si_signo)
            self._listen()
            process, status = os.waitpid(self._process, os.WNOHANG)
            if process:
                return self._ended(os.waitstatus_to_exitcode(status), before)
            if self._cause is None and self._watch is not None and self._watch.must_end(self._process):
                cause = self._watch.cause(dumped_frames(dump_of(self._process, self._words)))
                self._cause = f"{self._watch.name}: {cause}"
                os.kill(self._process, signal.SIGKILL)

    def _listen(self) -> None:
        with suppress(BlockingIOError):
            while more := os.read(self._news, 1 << 16):
                self._rest += more
        *lines, self._rest = self._rest.split(b"\n")
        for line in lines:
            kind, _, text = line.partition(b" ")
            limit, _, name = text.partition(b" ")
            if kind == _EPISODE:
                self._watch = Watchdog(name.decode(), float(limit), tell, time.monotonic)
            elif kind == _BEAT and self._watch is not None:
                self._watch.beat()
            elif kind in (_REST, _DONE):
                self._watch = None
            self._done = self._done or kind == _DONE

    def _ended(self, code: int, before: Set[int]) -> int:
        if self._cause is not None:
            tell(f"{self._cause}; what was logged before can be read")
            return 1
        if -code in PASSED_ON:  # on request: as the parent process expects it
            signal.signal(-code, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            signal.raise_signal(-code)
        if code >= 0 and self._done:
            return code
        tell(f"the process ended in the middle of its work: {describe_end(code, read_dump(self._words))}")
        return 1
