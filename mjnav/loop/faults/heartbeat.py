"""How long an episode may take on the wall, seen from the process that runs it and from the one that watches it.

A `Heartbeat` is told of every tick. An episode that has had its time ends there, in order, with `TimeUp`. One that
hangs in a tick does not come back to be told: whoever watches its process from outside (`Watchdog`) first asks it by a
signal to raise `TimeUp` where it hangs, which ends it in order, too; compiled code hears no such request, and the
process is ended. The wall decides nothing but whether an episode is given up, and what is given up has no result.
"""

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from traceback import FrameSummary, extract_stack
from types import FrameType

from mjnav.errors import MjnavError
from mjnav.loop.faults.location import location

MAX_SECONDS = 3600.0  # [s] on the wall that an episode may take, unless it is told otherwise
START = 120.0  # [s] more until its first tick: kernels may have to be compiled
STALL = 60.0  # [s] without a tick after which an episode is named
GRACE = 3.0  # [s] without a tick after which an episode beyond its time does not come back by itself
END_TIMEOUT = 5.0  # [s] between the request to end and the end of the process
INTERVAL = 1.0  # [s] between two beats that are sent
ASK, DUMP = signal.SIGUSR1, signal.SIGUSR2  # end the tick that hangs; say where the process is (faulthandler)

_FRAME = re.compile(r'^  File "(.+)", line (\d+) in (.+)$', re.MULTILINE)  # of faulthandler, innermost first


class TimeUp(MjnavError):
    """An episode has had its time on the wall."""


class Heartbeat:
    """Of one episode; call it at every tick. `send` is called every INTERVAL at most. Raises TimeUp."""

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

    @property
    def quiet(self) -> float:
        """[s] since the last tick."""
        return time.monotonic() - self._latest

    @property
    def hangs(self) -> bool:
        """Whether the time is over and the last tick does not come back."""
        return time.monotonic() > self._due and self.quiet > GRACE

    def end(self, frame: FrameType | None) -> str:
        """Ends the episode from now on, which hangs at `frame`; says so."""
        self.over = hang(self._limit, location(extract_stack(frame)) if frame else None)
        return self.over

    @contextmanager
    def on_signal(self) -> Iterator["Heartbeat"]:
        """Raises TimeUp where it hangs when ASK comes; on the main thread only."""

        def ask(number: int, frame: FrameType | None) -> None:
            if self.hangs:
                raise TimeUp(self.end(frame))

        before = signal.signal(ASK, ask)
        try:
            yield self
        finally:
            signal.signal(ASK, before)


class Watchdog:
    """One episode in another process, which sends its beats. `name` is what it is called when it hangs."""

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
        """It goes on."""
        self._latest = self._clock()
        if not self._begun:
            self._due = self._latest + self._limit
        self._begun, self._told = True, False

    def must_end(self, process: int) -> bool:
        """Names what makes no progress, and asks what hangs beyond its time to end; whether it must be ended."""
        now = self._clock()
        quiet = now - self._latest
        if quiet >= STALL and not self._told:
            self._told = True
            left = max(0.0, self._due - now)
            self._tell(f"{self.name} has made no progress for {quiet:.0f} s; it is ended in {left:.0f} s")
        if now <= self._due or quiet <= GRACE:
            return False
        if self._asked is None:
            self._asked = now
            os.kill(process, ASK)
        return now - self._asked > END_TIMEOUT

    def cause(self, frames: list[FrameSummary]) -> str:
        """Why it was ended, which hangs in these frames."""
        return hang(self._limit, location(frames))


def hang(limit: float, where: str | None) -> str:
    """Why an episode was ended that hangs, and where."""
    return f"a tick hangs{f' ({where})' if where else ''}: ended after {limit:g} s on the wall (--max-seconds)"


def dumped_frames(text: str) -> list[FrameSummary]:
    """The frames that faulthandler wrote of one thread, outermost first."""
    return [FrameSummary(file, int(line), name) for file, line, name in reversed(_FRAME.findall(text))]
