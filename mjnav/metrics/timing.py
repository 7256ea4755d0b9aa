"""Timing of a run: computing times of ticks, how well a paced run kept its schedule, causes of missed deadlines.

The cause is the loop, the machine, or work that a process does only once. A deadline was missed through the machine
where the loop, had the machine not stood still, would have met it; through first-time work (a kernel compiled or
loaded, a module imported) where it would have met it without that. All else is the loop's. What would have been is
computed by replaying the schedule with the time taken off.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import PHASES
from mjnav.metrics.definitions import HIGHER, INTEGER, LOWER, Definition, figures

# ----------------------------------------------------------------------------------- computing time


REPORTED = ("sense", "estimate", "control", "record")
CLOCK = (  # what the loop measures
    Definition("real_time_factor", "simulated time over wall time, from tick 0 on", better=HIGHER,
               null="no time passed", group="computing"),
    Definition("deadline_misses", "ticks that ended after the next was due; 0 where the run was not paced",
               type=INTEGER, better=LOWER, group="computing"),
)  # fmt: skip


@figures(
    "computing",
    *(
        Definition(f"compute_ms.{phase}.{level}", f"wall time of {what}; {quantile}",
                   words=f"time of {short}, {quantile}")
        for phase, short, what in (
            ("sense", "sensing", "the sensors' readings"),
            ("estimate", "estimation", "the filters and the prediction"),
            ("control", "a decision", "a decision of the controller"),
            ("record", "recording", "the record of the tick, the log included"),
            ("tick", "a tick", "a whole tick, physics included"),
        )
        for level, quantile in (("p50", "median"), ("p99", "99 % quantile"), ("max", "maximum"))
    ),
    better=LOWER, null="no ticks",
)  # fmt: skip
def compute_ms(timing: NDArray[np.int64]) -> dict[str, dict[str, float | None]]:
    """Median, 99 % quantile and maximum of the time by phase and of the whole tick, physics included [ms].

    `timing` (T, 7) is a trajectory's: tick, PHASES, lateness [ns]. None where there is no tick.
    """
    phases = timing[:, 1 : 1 + len(PHASES)] * 1e-6
    columns = np.column_stack([phases[:, [PHASES.index(name) for name in REPORTED]], phases.sum(-1)])
    levels = quantiles(columns)  # of all at once, which takes a third of the time
    return {
        name: {level: None if found is None else found[i] for level, found in levels.items()}
        for i, name in enumerate((*REPORTED, "tick"))
    }


def quantiles(values: NDArray[np.floating] | NDArray[np.integer], **more: float) -> dict[str, Any]:
    """p50, p99, `more` by name, and max of values (n,), or of (n, k) a list of k each. None without values."""
    levels = {"p50": 0.5, "p99": 0.99, **more}
    if not len(values):
        return dict.fromkeys((*levels, "max"))
    found = np.quantile(values, list(levels.values()), axis=0).tolist()
    return {**dict(zip(levels, found, strict=True)), "max": values.max(axis=0).astype(float).tolist()}


# ----------------------------------------------------------------------------- schedule and verdict


PASS, DEGRADED, FAIL, INCONCLUSIVE = "PASS", "DEGRADED", "FAIL", "INCONCLUSIVE"
LEAST_TICKS = 300  # without a miss in n ticks the share of misses is below 3 / n, 1 % here, at 95 % (the rule of three)
DEGRADED_SHARE = 0.01  # of ticks that may miss their deadline in a run that is not a failure
RATE_SHARE = 0.999  # of the requested rate that must be achieved
STOLEN_SHARE = 0.01  # of the processors' time that may go to other virtual machines

# In the order in which they are tried; the first that holds is the verdict. They are put to the schedule as it would
# have been without the machine's own gaps, which are reported beside the verdict.
RULES = (
    (INCONCLUSIVE, f"interrupted, or fewer than {LEAST_TICKS} ticks"),
    (PASS, f"no deadline missed, nothing of the log dropped, at least {100 * RATE_SHARE:g} % of the rate achieved"),
    (INCONCLUSIVE, f"other virtual machines took more than {100 * STOLEN_SHARE:g} % of the processors' time"),
    (
        DEGRADED,
        f"at most {100 * DEGRADED_SHARE:g} % of deadlines missed, every overrun made up for without skipping a period, "
        f"at least {100 * RATE_SHARE:g} % of the rate achieved",
    ),
    (FAIL, "all else"),
)

CAUSES = ("wake-up", *PHASES, "rest")  # of an overrun; the rest is what lies between phases, as writing the timing down


@dataclass(frozen=True, slots=True)
class Overrun:
    """The furthest that work went beyond a deadline, and which phase of which tick is to blame."""

    tick: int
    phase: str  # of CAUSES
    milliseconds: float


@dataclass(frozen=True, slots=True)
class Schedule:
    """What a paced run did to its schedule of n ticks. All arrays in ns."""

    period: float  # [s]
    wall: float  # [s] from the first tick's start to the end
    lateness: NDArray[np.int64]  # (n,) of each tick's start behind its deadline, once periods were skipped
    overrun: NDArray[np.int64]  # (n,) of each tick's work beyond the next one's deadline, skipped periods too; or 0
    phases: NDArray[np.int64]  # (n, len(PHASES)) of work
    busy: NDArray[np.int64]  # (n,) from each tick's start to the end of its work
    skipped: int = 0  # periods
    log_dropped: int = 0
    stolen: float = 0.0  # share of the processors' time that other virtual machines took
    interrupted: bool = False
    max_catch_up: int = 0  # periods that the pacer makes up for before it skips whole ones

    @property
    def ticks(self) -> int:
        """n"""
        return len(self.lateness)

    @property
    def misses(self) -> int:
        """Ticks that were still at work at the next one's deadline."""
        return int(np.count_nonzero(self.overrun))

    @property
    def achieved_hz(self) -> float:
        """Ticks a second of wall time."""
        return self.ticks / self.wall if self.wall > 0.0 else 0.0

    @property
    def waited(self) -> NDArray[np.bool_]:
        """(n,) which ticks had nothing but the clock to wait for: all but the first and those after a miss."""
        return np.concatenate([[False], self.overrun[:-1] == 0])[: self.ticks]

    @property
    def took(self) -> NDArray[np.int64]:
        """(n, len(CAUSES)) what each tick's time went to; a wake-up only where the tick had the clock to wait for."""
        wake_up = np.where(self.waited, self.lateness, 0)
        return np.column_stack([wake_up, self.phases, self.busy - self.phases.sum(axis=1)])


def verdict(schedule: Schedule) -> str:
    """PASS, DEGRADED, FAIL or INCONCLUSIVE, by RULES."""
    s = schedule
    enough = s.ticks >= LEAST_TICKS and not s.interrupted
    holds = (
        not enough,
        s.misses == 0 and s.log_dropped == 0 and s.achieved_hz >= RATE_SHARE / s.period,
        s.stolen > STOLEN_SHARE,
        s.misses <= DEGRADED_SHARE * s.ticks and s.skipped == 0 and s.achieved_hz >= RATE_SHARE / s.period,
        True,
    )
    return next(name for (name, _), hold in zip(RULES, holds, strict=True) if hold)


def wakeup_us(schedule: Schedule) -> dict[str, float | None]:
    """How late ticks began that had nothing but the clock to wait for [us]."""
    return quantiles(schedule.lateness[schedule.waited] * 1e-3, p999=0.999)


def longest_overrun(schedule: Schedule) -> Overrun | None:
    """None where no deadline was missed."""
    if not schedule.misses:
        return None
    worst = int(np.argmax(schedule.overrun))
    tick, phase = blamed(schedule, excess(schedule), worst)
    return Overrun(tick, phase, float(schedule.overrun[worst]) * 1e-6)


def excess(schedule: Schedule) -> NDArray[np.floating]:
    """(n, len(CAUSES)) how long each phase took beyond its own median [ns]."""
    took = schedule.took
    return took - np.median(took, axis=0) if schedule.ticks else took.astype(float)


def blamed(schedule: Schedule, beyond: NDArray[np.floating], tick: int) -> tuple[int, str]:
    """Which phase of which tick is to blame for a deadline that `tick` missed; `beyond` is the schedule's `excess`.

    A tick that began late because those before it were slow is not to blame: of all that happened since work was last
    done in time, it is the phase that took longest beyond its own median.
    """
    in_time = np.flatnonzero(schedule.overrun[:tick] == 0)
    first = int(in_time[-1]) + 1 if in_time.size else 0
    since = beyond[first : tick + 1]
    number, cause = np.unravel_index(np.argmax(since), since.shape)
    return first + int(number), CAUSES[int(cause)]


# ----------------------------------------------------------------------- causes of missed deadlines


LOOP, MACHINE, FIRST_TIME = "loop", "machine", "first-time work"
MAX_NAMED = 100  # misses that are named, the longest; all are counted


@dataclass(frozen=True, slots=True)
class Miss:
    """One deadline missed: by `tick`, for what happened in `phase` of tick `since`, because of `cause`."""

    tick: int
    since: int
    phase: str  # of CAUSES
    cause: str  # LOOP, MACHINE or FIRST_TIME
    milliseconds: float  # beyond the deadline


@dataclass(frozen=True, slots=True)
class Blame:
    """The misses of a schedule by cause, and the schedule as it would have been but for the machine."""

    own: Schedule
    counts: dict[str, int]
    misses: tuple[Miss, ...]  # the MAX_NAMED longest, by tick


def overlap(schedule: Schedule, began: NDArray[np.int64], intervals: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n, len(CAUSES)) how much of each phase of each tick lies in the intervals [ns].

    `began` (n,) is when each tick's work did, and `intervals` (m, 2) are begins and ends on the same clock, in any
    order, one within another or not.
    """
    if not intervals.size or not schedule.ticks:
        return np.zeros((schedule.ticks, len(CAUSES)), np.int64)
    took = schedule.took
    edges = np.cumsum(took, axis=1) + (began - began[0] - took[:, 0])[:, None]
    edges = np.column_stack([edges[:, 0] - took[:, 0], edges])
    merged = _merged(intervals - began[0])
    covered = np.concatenate([[0], np.cumsum(merged[:, 1] - merged[:, 0])])
    at = np.column_stack([covered[:-1], covered[1:]]).ravel()
    return np.diff(np.interp(edges, merged.ravel(), at), axis=1).round().astype(np.int64)


def with_stolen(schedule: Schedule, stood_still: NDArray[np.int64], stolen: NDArray[np.int64]) -> NDArray[np.int64]:
    """`stood_still` (n, len(CAUSES)), but where more was stolen from a tick (n,) [ns] than that, this in its place.

    When time was stolen is not known: it is assigned to the phase that took longest beyond its median.
    """
    found = stood_still.copy()
    more = np.flatnonzero(stolen > stood_still.sum(axis=1))
    phase = 1 + np.argmax(excess(schedule)[more, 1:], axis=1)
    found[more] = 0
    found[more, phase] = np.minimum(stolen[more], schedule.took[more, phase])
    return found


def without(schedule: Schedule, spent: NDArray[np.int64]) -> Schedule:
    """The schedule as the pacer would have kept it, had the ticks not `spent` (n, len(CAUSES)) [ns] of their phases.

    A tick that met its deadline in truth counts as having met it.
    """
    if not spent.any():
        return schedule
    s = schedule
    period = round(1e9 * s.period)
    took = np.maximum(s.took - spent, 0)
    work = took[:, 1:].sum(axis=1)
    lateness, overrun = np.zeros_like(s.lateness), np.zeros_like(s.overrun)
    deadline = free = skipped = 0
    for tick in range(s.ticks):
        begin = max(deadline + int(took[tick, 0]), free)
        free = begin + int(work[tick])
        lateness[tick], deadline = begin - deadline, deadline + period
        late = max(0, free - deadline)
        if late and s.overrun[tick]:
            overrun[tick] = late
        given_up = late // period if late // period > s.max_catch_up else 0
        skipped += given_up
        deadline += given_up * period
    wall = 1e-9 * max(deadline, free) if s.ticks else s.wall
    phases, rest = took[:, 1 : 1 + len(PHASES)], took[:, 1 + len(PHASES)]
    return replace(
        s, wall=wall, lateness=lateness, overrun=overrun, phases=phases, busy=phases.sum(axis=1) + rest, skipped=skipped
    )


def blame(schedule: Schedule, stood_still: NDArray[np.int64], first_time: NDArray[np.int64]) -> Blame:
    """Every miss with its cause.

    `stood_still` and `first_time` (n, len(CAUSES)) say how long the machine stood still and how long work took that is
    done once, in each phase of each tick [ns].
    """
    own = without(schedule, stood_still)
    steady = without(schedule, stood_still + first_time)
    cause = np.where(own.overrun == 0, MACHINE, np.where(steady.overrun == 0, FIRST_TIME, LOOP))
    missed = np.flatnonzero(schedule.overrun)
    counts = {name: int(np.count_nonzero(cause[missed] == name)) for name in (LOOP, MACHINE, FIRST_TIME)}
    longest = np.sort(missed[np.argsort(-schedule.overrun[missed], kind="stable")][:MAX_NAMED])
    seen_in = {LOOP: steady, MACHINE: schedule, FIRST_TIME: own}
    beyond = {name: excess(found) for name, found in seen_in.items()}
    misses = []
    for tick in longest.tolist():
        name = str(cause[tick])
        since, phase = blamed(seen_in[name], beyond[name], tick)
        misses.append(Miss(tick, since, phase, name, float(schedule.overrun[tick]) * 1e-6))
    return Blame(own, counts, tuple(misses))


def _merged(intervals: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 2) the same time in intervals that follow one another."""
    rows = intervals[np.argsort(intervals[:, 0], kind="stable")]
    ends = np.maximum.accumulate(rows[:, 1])
    first = np.concatenate([[True], rows[1:, 0] > ends[:-1]])
    last = np.concatenate([first[1:], [True]])
    return np.column_stack([rows[first, 0], ends[last]])
