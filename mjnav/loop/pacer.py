"""The only place that reads a clock: when a tick may begin, and how long its phases took.

The clock never reaches the simulation: a run paced, late or unpaced has the same states.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from mjnav.errors import unknown_name

Clock = Callable[[], int]
POLICIES = ("skip", "abort")
SPIN = 300_000  # [ns] before a deadline that are spun instead of slept: a sleep wakes 50-150 us late
MAX_CATCH_UP = 3  # periods that may be made up for before whole periods are skipped


@dataclass(frozen=True, slots=True)
class Start:
    """How a tick began: behind its deadline by `lateness` [ns], and whether it missed it.

    `skipped` periods were given up before it, which its deadline has moved by, and `abort` asks for the end of the run.
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


@dataclass(slots=True)
class Stopwatch:
    """Time by phase of one tick: `lap` closes the phase that is running."""

    now: Clock
    phases: list[int] = field(default_factory=list)
    _since: int = 0

    def start(self) -> None:
        """A new tick begins."""
        self.phases = []
        self._since = self.now()

    def lap(self) -> None:
        """The running phase ends, the next begins."""
        now = self.now()
        self.phases.append(now - self._since)
        self._since = now
