"""How well a paced run kept its schedule, and what to think of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

PASS, DEGRADED, FAIL, INCONCLUSIVE = "PASS", "DEGRADED", "FAIL", "INCONCLUSIVE"
LEAST_TICKS = 300  # without a miss in n ticks the share of misses is below 3 / n, 1 % here, at 95 % (the rule of three)
DEGRADED_SHARE = 0.01  # of ticks that may miss their deadline in a run that is not a failure
RATE_SHARE = 0.999  # of the requested rate that must be achieved
STOLEN_SHARE = 0.01  # of the processors' time that may go to other virtual machines

# In the order in which they are tried; the first that holds is the verdict.
RULES = (
    (INCONCLUSIVE, f"interrupted, or fewer than {LEAST_TICKS} ticks"),
    (PASS, f"no deadline missed, nothing of the log dropped, at least {100 * RATE_SHARE:g} % of the rate achieved"),
    (INCONCLUSIVE, f"other virtual machines took more than {100 * STOLEN_SHARE:g} % of the processors' time"),
    (
        DEGRADED,
        f"at most {100 * DEGRADED_SHARE:g} % of deadlines missed, every overrun made up for without skipping a period",
    ),
    (FAIL, "all else"),
)


@dataclass(frozen=True, slots=True)
class Overrun:
    """The tick that was at work longest behind the next one's deadline, and the phase that took unusually long."""

    tick: int
    phase: str
    milliseconds: float  # behind the deadline


@dataclass(frozen=True, slots=True)
class Schedule:
    """What a paced run did to its schedule of n ticks."""

    ticks: int
    period: float  # [s]
    wall: float  # [s] from the first tick's start to the end
    lateness: NDArray[np.int64]  # (n,) [ns] of each tick's start behind its deadline
    missed: NDArray[np.bool_]  # (n,) whether the tick before it was at work at its deadline
    skipped: int  # periods
    log_dropped: int
    stolen: float  # share of the processors' time that other virtual machines took
    interrupted: bool = False

    @property
    def achieved_hz(self) -> float:
        """Ticks a second of wall time."""
        return self.ticks / self.wall if self.wall > 0.0 else 0.0


def verdict(schedule: Schedule) -> str:
    """PASS, DEGRADED, FAIL or INCONCLUSIVE, by RULES."""
    s = schedule
    misses = int(s.missed.sum())
    enough = s.ticks >= LEAST_TICKS and not s.interrupted
    holds = (
        not enough,
        misses == 0 and s.log_dropped == 0 and s.achieved_hz >= RATE_SHARE / s.period,
        s.stolen > STOLEN_SHARE,
        misses <= DEGRADED_SHARE * s.ticks and s.skipped == 0 and s.achieved_hz >= RATE_SHARE / s.period,
        True,
    )
    return next(name for (name, _), hold in zip(RULES, holds, strict=True) if hold)


def wakeup_us(schedule: Schedule) -> dict[str, float | None]:
    """How late ticks began that had nothing to wait for but the clock [us]; without the first."""
    waited = schedule.lateness[1:][~schedule.missed[1:]] * 1e-3
    if not waited.size:
        return dict.fromkeys(("p50", "p99", "p999", "max"))
    p50, p99, p999 = np.quantile(waited, [0.5, 0.99, 0.999]).tolist()
    return {"p50": p50, "p99": p99, "p999": p999, "max": float(waited.max())}


def longest_overrun(schedule: Schedule, phases: NDArray[np.int64], names: Sequence[str]) -> Overrun | None:
    """None where no deadline was missed. `phases` (n, len(names)) is each tick's time by phase [ns].

    The phase is the one furthest above its own median.
    """
    misses = np.flatnonzero(schedule.missed)
    if not misses.size:
        return None
    culprit = max(0, int(misses[np.argmax(schedule.lateness[misses])]) - 1)
    excess = phases[culprit] - np.median(phases, axis=0)
    return Overrun(culprit, names[int(np.argmax(excess))], float(schedule.lateness[misses].max()) * 1e-6)


def histogram(values: NDArray[np.floating], edges: Sequence[float]) -> list[tuple[float, float, int]]:
    """(low, high, count) of the bins between the edges, from the first that is not empty to the last."""
    bounds = [-inf, *edges, inf]
    counts = np.histogram(values, bounds)[0].tolist()
    rows = list(zip(bounds[:-1], bounds[1:], counts, strict=True))
    filled = [i for i, count in enumerate(counts) if count]
    return rows[filled[0] : filled[-1] + 1] if filled else []
