"""When a decision takes effect, where it is not after whole periods."""

from dataclasses import dataclass

import numpy as np

from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.ranges import MAX_LATENCY, check_range

MODELS = ("sampled", "measured")
ORDERS = ("drawn", "recorded")
MAX_PENDING = 1000  # commands that are decided but not yet in force


@dataclass(frozen=True, slots=True)
class Latency:
    """A decision takes effect when it has been computed, at the next physics step; in place of `delay`.

    `sampled` takes that time from a trace: drawn from it, or in the order in which it was recorded, over and over.
    `measured` takes the time that this machine needed: such a run cannot be repeated, but its log holds a scenario that
    does repeat it.
    """

    model: str = "sampled"
    trace: tuple[float, ...] = ()  # [s]
    order: str = "drawn"
    planned: float | None = None  # [s] that the prediction counts on; by default the trace's median, or half a period

    def __post_init__(self):
        for key, names in (("model", MODELS), ("order", ORDERS)):
            if getattr(self, key) not in names:
                raise unknown_name(key, getattr(self, key), names)
        if self.model == "sampled" and not self.trace:
            raise InvalidValue("trace", None, "compute times [s], or the path of a text file of them")
        if self.model == "measured" and self.trace:
            raise InvalidValue("trace", self.trace, 'a trace for model "sampled" only')
        for i, value in enumerate(self.trace):
            check_range(f"trace.{i}", value, 0.0, MAX_LATENCY)
        if self.planned is not None:
            check_range("planned", self.planned, 0.0, MAX_LATENCY)

    def expected(self, period: float) -> float:
        """What the prediction counts on where the control period is `period`, both [s]."""
        if self.planned is not None:
            return self.planned
        return float(np.median(self.trace)) if self.trace else 0.5 * period

    def check_expected(self, period: float) -> None:
        """Refuses to carry beliefs through more than MAX_PENDING commands at every tick."""
        if self.expected(period) > MAX_PENDING * period:
            found = f"{self.expected(period):g} s at a period of {period:g} s"
            raise InvalidValue(
                "planned", found, f"at most {MAX_PENDING} periods: every tick predicts through all of them"
            )
