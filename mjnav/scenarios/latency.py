"""When a decision takes effect, where it is not after whole periods."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mjnav.config import Choice, Range, settle
from mjnav.errors import InvalidValue

Delay = Annotated[float, Range(0.0, 1000.0, "s")]  # up to a hundred periods of the slowest loop, as control.delay
MAX_PENDING = 1000  # commands that are decided but not yet in force


@dataclass(frozen=True, slots=True)
class Latency:
    """A decision takes effect when it has been computed, at the next physics step; in place of `delay`.

    `sampled` takes that time from a trace: drawn from it, or in the order in which it was recorded, over and over.
    `measured` takes the time that this machine needed: such a run cannot be repeated, but its log holds a scenario that
    does repeat it.
    """

    model: Annotated[str, Choice(("sampled", "measured")), "sampled: from the trace; measured: this machine's"] = (
        "sampled"
    )
    trace: Annotated[tuple[Delay, ...], "compute times, or in a file the path of a text file of them"] = ()
    order: Annotated[str, Choice(("drawn", "recorded")), "in which a trace's times are taken"] = "drawn"
    planned: Annotated[Delay | None, "what the prediction counts on: else the trace's median, or half a period"] = None

    def __post_init__(self):
        settle(self)
        if self.model == "sampled" and not self.trace:
            raise InvalidValue("trace", None, "compute times [s], or the path of a text file of them")
        if self.model == "measured" and self.trace:
            raise InvalidValue("trace", self.trace, 'a trace for model "sampled" only')

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
