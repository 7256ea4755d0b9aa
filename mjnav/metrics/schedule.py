"""How well a paced run kept its schedule, and what to think of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import PHASES
from mjnav.metrics.timing import quantiles

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


def histogram(values: NDArray[np.floating], edges: Sequence[float]) -> list[tuple[float, float, int]]:
    """(low, high, count) of the bins between the edges, from the first that is not empty to the last."""
    bounds = [-inf, *edges, inf]
    counts = np.histogram(values, bounds)[0].tolist()
    rows = list(zip(bounds[:-1], bounds[1:], counts, strict=True))
    filled = [i for i, count in enumerate(counts) if count]
    return rows[filled[0] : filled[-1] + 1] if filled else []
