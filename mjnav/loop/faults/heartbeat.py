"""The limit on an episode's wall time, kept in the process that runs it and in the process that watches it; how and
where in the user's code a process ended.

A `Heartbeat` is called at every tick, and raises `TimeUp` when the time is over. An episode that hangs inside a tick
does not call it. The `Watchdog` in another process then sends a signal whose handler raises `TimeUp` where the episode
hangs; compiled code does not run handlers, so its process is ended. Wall time decides only whether an episode is given
up, and an episode that is given up has no result.
"""

import faulthandler
import os
import re
import select
import signal
import sysconfig
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from traceback import FrameSummary, extract_stack
from types import FrameType

from mjnav.errors import MjnavError

# ------------------------------------------------------------------------------------------ heartbeat


MAX_SECONDS = 3600.0  # [s] of wall time that an episode may take by default
START = 120.0  # [s] more until its first tick: kernels may have to be compiled
STALL = 60.0  # [s] without a tick after which an episode is named
GRACE = 3.0  # [s] without a tick after which an episode beyond its time counts as hanging
END_TIMEOUT = 5.0  # [s] between the request to end and the end of the process
INTERVAL = 1.0  # [s] between two beats that are sent
ASK, DUMP = signal.SIGUSR1, signal.SIGUSR2  # end the tick that hangs; say where the process is (faulthandler)


class TimeUp(MjnavError):
    """An episode has used up its wall time."""


class Heartbeat:
    """One episode's clock; call it at every tick. It calls `send` at most once an INTERVAL. Raises TimeUp."""

    def __init__(self, limit: float = MAX_SECONDS, send: Callable[[], None] = lambda: None):
        self.over: str | None = None  # why the episode was ended
        self._limit, self._send = limit, send
        self._latest = time.monotonic()
        self._due = self._latest + START + limit
        self._sent: float | None = None  # when; None before the first tick

    def __call__(self, simulated: float = 0.0) -> None:
        """One more tick, at a simulated time [s]."""
        now = self._latest = time.monotonic()
        if self._sent is None:
            self._due = now + self._limit
        if self.over is None and now > self._due:
            self.over = f"still running after {self._limit:g} s on the wall (--max-seconds)"
        if self.over is not None:
            raise TimeUp(self.over)
        if self._sent is None or now - self._sent >= INTERVAL:
            self._sent = now
            self._send()

    def begin_again(self) -> None:
        """The episode is run once more, with all of its time."""
        self._latest = time.monotonic()
        self._due = self._latest + START + self._limit
        self._sent = None

    @property
    def quiet(self) -> float:
        """[s] since the last tick."""
        return time.monotonic() - self._latest

    @property
    def hangs(self) -> bool:
        """Whether the time is over and no tick has ended for GRACE."""
        return time.monotonic() > self._due and self.quiet > GRACE

    def end(self, frame: FrameType | None) -> str:
        """Marks the episode as ended, hanging at `frame`; returns the reason."""
        self.over = hang(self._limit, location(extract_stack(frame)) if frame else None)
        return self.over

    @contextmanager
    def on_signal(self) -> Iterator["Heartbeat"]:
        """While it lasts, the signal ASK raises TimeUp where the episode hangs; on the main thread only."""

        def ask(number: int, frame: FrameType | None) -> None:
            if self.hangs and self.over is None:  # it is asked until it ends
                raise TimeUp(self.end(frame))

        before = signal.signal(ASK, ask)
        try:
            yield self
        finally:
            signal.signal(ASK, before)


class Watchdog:
    """Watches one episode in another process, which sends its beats. `name` stands in messages."""

    def __init__(
        self, name: str, limit: float, tell: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ):
        self.name = name
        self._limit, self._tell, self._clock = limit, tell, clock
        self._latest = clock()
        self._due = self._latest + START + limit
        self._begun = self._told = False
        self._asked: float | None = None

    def beat(self) -> None:
        """The episode sent a beat."""
        self._latest = self._clock()
        if not self._begun:
            self._due = self._latest + self._limit
        self._begun, self._told = True, False

    def must_end(self, process: int) -> bool:
        """Reports a stall, asks an episode that hangs beyond its time to end; says whether to end its process."""
        now = self._clock()
        quiet = now - self._latest
        if quiet >= STALL and not self._told:
            self._told = True
            self._tell(f"{self.name} has {self._stalled(now, quiet)}")
        if now <= self._due or quiet <= GRACE:
            return False
        if self._asked is None:
            self._asked = now
        if now - self._asked > END_TIMEOUT:
            return True
        os.kill(process, ASK)  # every time: after its last beat it may have had ticks, and not hang for GRACE yet
        return False

    def _stalled(self, now: float, quiet: float) -> str:
        if not self._begun:
            allowed = f"it has {self._limit:g} s, and {START:g} s to begin"
            return f"not begun after {quiet:.0f} s (it may be compiling); {allowed}"
        return f"made no progress for {quiet:.0f} s; it is ended in {max(0.0, self._due - now):.0f} s"

    def cause(self, frames: list[FrameSummary]) -> str:
        """Why the episode, which hung in these frames, was ended."""
        return hang(self._limit, location(frames))


def hang(limit: float, where: str | None) -> str:
    """The reason for ending an episode that hangs, and where it did."""
    return f"a tick hangs{f' ({where})' if where else ''}: ended after {limit:g} s on the wall (--max-seconds)"


# -------------------------------------------------------------------------------- where and how it ended


_FRAME = re.compile(r'^  File "(.+)", line (\d+) in (.+)$', re.MULTILINE)  # of faulthandler, innermost first
_MAX_DUMP = 1 << 16  # [bytes]; faulthandler writes at most 100 frames
_PATIENCE = 0.5  # [s] until a dump begins
_PAUSE = 0.1  # [s] between two pieces of it: it is written in many


def location(frames: Iterable[FrameSummary], *, users_only: bool = False) -> str | None:
    """ "file:line, in function" of a stack, outermost frame first.

    That is the innermost frame of the user's own code, or else of mjnav's unless `users_only`: not that of a library
    below it.
    """
    frames = [frame for frame in frames if Path(frame.filename).is_file()]
    package = Path(__file__).parents[2]
    libraries = [Path(sysconfig.get_path(name)) for name in ("stdlib", "purelib", "platlib")]
    ours = [frame for frame in frames if Path(frame.filename).is_relative_to(package)]
    users = [frame for frame in frames if not any(map(Path(frame.filename).is_relative_to, (package, *libraries)))]
    for found in (users,) if users_only else (users, ours, frames):
        if found:
            return f"{found[-1].filename}:{found[-1].lineno}, in {found[-1].name}"
    return None


def dump_to(descriptor: int) -> None:
    """Dumps the stack to `descriptor` on a fatal signal and on DUMP, without the interpreter's lock."""
    faulthandler.enable(descriptor, all_threads=False)  # type: ignore[arg-type] - a descriptor, as documented
    faulthandler.register(DUMP, descriptor, all_threads=False)  # type: ignore[arg-type]


def dump_of(process: int, descriptor: int) -> str:
    """The stack that the process dumps when it is asked to; empty where it does not answer."""
    os.kill(process, DUMP)
    return read_dump(descriptor, _PATIENCE)


def read_dump(descriptor: int, patience: float = 0.0) -> str:
    """What has been dumped to `descriptor`."""
    text = b""
    while select.select([descriptor], [], [], _PAUSE if text else patience)[0]:
        if not (piece := os.read(descriptor, _MAX_DUMP)):
            break
        text += piece
    return text.decode(errors="replace")


def describe_end(exit_code: int, dump: str) -> str:
    """How a process ended, from its exit code or minus the signal that ended it, and where, if it dumped its stack."""
    named = {one.value: one.name for one in signal.Signals}
    what = (
        f"exit code {exit_code}, as os._exit does" if exit_code >= 0 else named.get(-exit_code, f"signal {-exit_code}")
    )
    where = location(dumped_frames(dump))
    return f"{what} ({where})" if where else what


def dumped_frames(text: str) -> list[FrameSummary]:
    """The frames that faulthandler wrote of one thread, outermost first."""
    return [FrameSummary(file, int(line), name) for file, line, name in reversed(_FRAME.findall(text))]
