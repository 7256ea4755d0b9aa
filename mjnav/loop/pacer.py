"""The only place that reads a clock: when a tick may begin, and how long its phases took.

The clock never reaches the simulation: a run paced, late or unpaced has the same states.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from mjnav.errors import unknown_name
from mjnav.messages import PHASES

Clock = Callable[[], int]
POLICIES = ("skip", "abort")
SPIN = 300_000  # [ns] before a deadline in which the pacer spins instead of sleeping: a sleep wakes 50-150 us late
MAX_CATCH_UP = 3  # periods that may be made up for before whole periods are skipped


@dataclass(frozen=True, slots=True)
class Start:
    """How a tick began: `lateness` [ns] behind its deadline, and whether the tick before it was still at work then.

    Before it, `skipped` whole periods were dropped from the schedule; `abort` asks for the end of the run.
    """

    lateness: int
    missed: bool
    skipped: int = 0
    abort: bool = False


class Pacer(Protocol):
    """Says when the next tick may begin; `now` is the clock [ns]."""

    now: Clock
    real_time: bool  # whether time on the wall counts

    def wait(self) -> Start:
        """Returns when the next tick may begin."""
        ...


class FreePacer:
    """Begins every tick at once: as fast as the machine can."""

    real_time = False

    def __init__(self, clock: Clock = time.perf_counter_ns):
        self.now = clock

    def wait(self) -> Start:
        """Never waits."""
        return Start(0, False)


class RealTimePacer:
    """Begins tick k at start + k period on the wall: sleeps, then spins the last stretch.

    A tick misses its deadline if the one before it was still at work at that moment. What is late by no more than
    `max_catch_up` periods is caught up with; beyond that the schedule moves on by whole periods, keeping its phase.
    Under the policy "abort" the first deadline missed ends the run instead. Raises InvalidValue for another policy.
    """

    real_time = True

    def __init__(
        self,
        period: float,
        *,
        max_catch_up: int = MAX_CATCH_UP,
        policy: str = "skip",
        clock: Clock = time.perf_counter_ns,
        sleep: Callable[[float], None] = time.sleep,
    ):
        if policy not in POLICIES:
            raise unknown_name("overruns", policy, POLICIES)
        self.now = clock
        self._policy = policy
        self._sleep = sleep
        self._period = round(period * 1e9)
        self._max_catch_up = max_catch_up
        self._deadline: int | None = None

    def wait(self) -> Start:
        """Returns at the next tick's deadline, at once if it has passed. The first call starts the schedule."""
        now = self.now()
        if self._deadline is None:
            self._deadline = now
        else:
            self._deadline += self._period
        missed = now > self._deadline
        if missed and self._policy == "abort":
            return Start(now - self._deadline, missed, abort=True)
        skipped = (now - self._deadline) // self._period
        skipped = skipped if skipped > self._max_catch_up else 0
        self._deadline += skipped * self._period
        while (left := self._deadline - self.now()) > 0:
            if left > SPIN:
                self._sleep((left - SPIN) * 1e-9)
        return Start(max(0, self.now() - self._deadline), missed, skipped)


# span -> the phase of `messages.PHASES` that it is a part of
SPANS = MappingProxyType(
    {
        "truth": "sense",
        "readings": "sense",
        "estimate": "estimate",
        "predict": "control",
        "decide": "control",
        "actuate": "record",
        "write": "record",
        "advance": "advance",
    }
)
BETWEEN = "between"  # the end of a tick's last span and the start of the next tick


class Stopwatch:
    """Times the spans of one tick after another; `spans` are those of the present tick [ns].

    What passes between two spans belongs to the second, unless `pauses`: then it belongs to none.
    """

    def __init__(self, now: Clock = time.perf_counter_ns, *, pauses: bool = False):
        self._now = now
        self._pauses = pauses
        self.spans: dict[str, int] = {}
        self._since: int | None = None  # when the running span began

    def start(self) -> None:
        """A new tick begins; the time since the last span of the tick before is added to that tick's spans."""
        now = self._now()
        if self._since is not None and not self._pauses:
            self.spans[BETWEEN] = now - self._since
        self.spans, self._since = {}, now

    def resume(self) -> None:
        """The next span begins now, where there are pauses between spans."""
        if self._pauses:
            self._since = self._now()

    def lap(self, span: str) -> None:
        """The running span, which is called `span`, ends; the next begins."""
        now = self._now()
        assert self._since is not None, "start() comes before lap()"
        self.spans[span] = now - self._since
        self._since = now

    @property
    def elapsed(self) -> float:
        """The tick's spans so far [s]."""
        return 1e-9 * sum(self.spans.values())

    @property
    def phases(self) -> tuple[int, ...]:
        """The tick's time by phase [ns], in the order of PHASES."""
        taken: dict[str, int] = dict.fromkeys(PHASES, 0)
        for span, time_ns in self.spans.items():
            taken[SPANS[span]] += time_ns
        return tuple(taken.values())
