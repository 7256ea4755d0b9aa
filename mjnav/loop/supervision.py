"""What ends an episode before its time: a fault, or the limit on its wall time; how and where a process ended.

A `Heartbeat` is called at every tick, and raises `TimeUp` when the time is over. An episode that hangs inside a tick
does not call it. An alarm then raises `TimeUp` where the episode hangs; compiled code does not run handlers of signals,
so there Python's faulthandler writes the stack down and ends the process. Wall time decides only whether an episode is
given up, and an episode that is given up has no result.
"""

import faulthandler
import os
import re
import signal
import sysconfig
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from traceback import FrameSummary
from types import FrameType
from typing import TYPE_CHECKING

from mjnav.errors import InvalidValue, MjnavError, PluginFault, message, said

if TYPE_CHECKING:  # the process that guards a command loads neither, to start at once
    from mjnav.loop.result import Result
    from mjnav.messages import Event

# ------------------------------------------------------------------------------------------- faults


class RunFault(MjnavError):
    """A fault ended a run: its outcome is `aborted`, its log is complete as far as the disk took it.

    `result` is that of the ticks before; None where they allow none.
    """

    def __init__(self, text: str, result: "Result | None" = None):
        super().__init__(text)
        self.result = result


def describe_fault(error: BaseException) -> str:
    """One line: mjnav's own words, or an exception's type, its message and the place in the user's code.

    A value that the user's code handed over and mjnav refused is told with that place, too.
    """
    ours = isinstance(error, MjnavError)
    if ours and not isinstance(error, InvalidValue):
        return message(error)
    where = location(traceback.extract_tb(error.__traceback__), users_only=ours)
    if where is None:
        return message(error) if ours else said(error)
    return f"{said(error)} ({where})"


def fault_events(error: BaseException) -> "tuple[Event, ...]":
    """The log's events about the error, with the traceback of code that is not mjnav's own."""
    from mjnav.messages import Event

    fault = Event("error", "fault", describe_fault(error))
    raised = error.__cause__ if isinstance(error, PluginFault) else error
    if raised is None or isinstance(raised, MjnavError):
        return (fault,)
    return fault, Event("info", "traceback", "".join(traceback.format_exception(raised)))


def location(frames: Iterable[FrameSummary], *, users_only: bool = False) -> str | None:
    """ "file:line, in function" of a stack, outermost frame first.

    That is the innermost frame of the user's own code, or else of mjnav's unless `users_only`: not that of a library
    below it.
    """
    frames = [frame for frame in frames if Path(frame.filename).is_file()]
    package = Path(__file__).parents[1]
    libraries = [Path(sysconfig.get_path(name)) for name in ("stdlib", "purelib", "platlib")]
    ours = [frame for frame in frames if Path(frame.filename).is_relative_to(package)]
    users = [frame for frame in frames if not any(map(Path(frame.filename).is_relative_to, (package, *libraries)))]
    for candidates in (users,) if users_only else (users, ours, frames):
        if candidates:
            return f"{candidates[-1].filename}:{candidates[-1].lineno}, in {candidates[-1].name}"
    return None


# ---------------------------------------------------------------------------------------- wall time


MAX_SECONDS = 3600.0  # [s] of wall time that an episode may take by default
START = 120.0  # [s] more until its first tick: kernels may have to be compiled
STALL = 60.0  # [s] without a tick after which an episode is named
GRACE = 3.0  # [s] without a tick after which an episode beyond its time counts as hanging
END_TIMEOUT = 5.0  # [s] between the request to end and the end of the process
INTERVAL = 1.0  # [s] between two looks at a heartbeat


class TimeUp(MjnavError):
    """An episode has used up its wall time."""


class Heartbeat:
    """One episode's limit of wall time [s]; call it at every tick. Raises TimeUp.

    A process with a file `descriptor` for its last words writes them there, and ends, where nothing else ends it.
    """

    def __init__(self, limit: float = MAX_SECONDS, descriptor: int | None = None):
        self.over: str | None = None  # why the episode was ended
        self._limit, self._descriptor = limit, descriptor
        self._begun = False
        self._allow(START + self._limit)

    def __call__(self, simulated: float = 0.0) -> None:
        """One more tick, at a simulated time [s]."""
        if not self._begun:
            self._begun = True
            self._allow(self._limit)
            return
        self._latest = time.monotonic()
        if self.over is None and self.left < 0.0:
            self.over = f"still running after {self._limit:g} s on the wall (--max-seconds)"
        if self.over is not None:
            raise TimeUp(self.over)

    @property
    def quiet(self) -> float:
        """[s] since the last tick."""
        return time.monotonic() - self._latest

    @property
    def left(self) -> float:
        """[s] until the time is over."""
        return self._due - time.monotonic()

    @property
    def hangs(self) -> bool:
        """Whether the time is over and no tick has ended for GRACE."""
        return self.left < 0.0 and self.quiet > GRACE

    def end(self, frame: FrameType | None) -> str:
        """Marks the episode as ended, hanging at `frame`; returns the reason."""
        self.over = hang(self._limit, location(traceback.extract_stack(frame)) if frame else None)
        return self.over

    def _allow(self, seconds: float) -> None:
        self._latest = time.monotonic()
        self._due = self._latest + seconds
        if self._descriptor is not None:
            patience = seconds + GRACE + END_TIMEOUT
            faulthandler.dump_traceback_later(patience, exit=True, file=self._descriptor)  # type: ignore[arg-type]


@contextmanager
def supervised(limit: float, tell: Callable[[str], None], descriptor: int | None = None) -> Iterator[Heartbeat]:
    """A heartbeat for an episode on the main thread, with a limit of wall time [s].

    `tell` gets the end of a sentence about an episode that makes no progress. What hangs beyond the limit is ended, in
    compiled code by the end of the process, where it has a `descriptor` to write its last words to.
    """
    heart, told = Heartbeat(limit, descriptor), False

    def look(number: int, frame: FrameType | None) -> None:
        nonlocal told
        stalls = heart.quiet >= STALL
        if stalls and not told:
            tell(f"has made no progress for {heart.quiet:.0f} s; it is ended in {max(0.0, heart.left):.0f} s")
        told = stalls
        if heart.hangs and heart.over is None:
            raise TimeUp(heart.end(frame))

    before = signal.signal(signal.SIGALRM, look)
    signal.siginterrupt(signal.SIGALRM, False)
    signal.setitimer(signal.ITIMER_REAL, INTERVAL, INTERVAL)
    try:
        yield heart
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        if descriptor is not None:
            faulthandler.cancel_dump_traceback_later()


def hang(limit: float | None, where: str | None) -> str:
    """The reason for ending an episode that hangs, and where it did."""
    after = "its time" if limit is None else f"{limit:g} s"
    return f"a tick hangs{f' ({where})' if where else ''}: ended after {after} on the wall (--max-seconds)"


# ------------------------------------------------------------------------------------ last words


_FRAME = re.compile(r'^  File "(.+)", line (\d+) in (.+)$', re.MULTILINE)  # of faulthandler, innermost first
_THREAD = re.compile(r"^.*\(most recent call first\):$", re.MULTILINE)
_TIMEOUT = re.compile(r"^Timeout \(", re.MULTILINE)
MOST_WORDS = 1 << 20  # [bytes]


def describe_end(died: str, exit_code: int, words: int, limit: float | None = None) -> str:
    """How a process ended that `died`, from its exit code or minus the signal that ended it, and where.

    `words` is the descriptor of the file to which faulthandler wrote its stack, if it did; `limit` the wall time [s]
    that its episode had.
    """
    dump = os.pread(words, MOST_WORDS, 0).decode(errors="replace")
    where = location(dumped_frames(dump))
    if exit_code == 1 and _TIMEOUT.search(dump):
        return hang(limit, where)
    names = {number.value: number.name for number in signal.Signals}
    what = (
        f"exit code {exit_code}, as os._exit does" if exit_code >= 0 else names.get(-exit_code, f"signal {-exit_code}")
    )
    return f"{died}: {what}{f' ({where})' if where else ''}"


def dumped_frames(dump: str) -> list[FrameSummary]:
    """The frames that faulthandler wrote of the main thread, the last of them, outermost first."""
    *_, main = _THREAD.split(dump)
    return [FrameSummary(file, int(line), name) for file, line, name in reversed(_FRAME.findall(main))]
