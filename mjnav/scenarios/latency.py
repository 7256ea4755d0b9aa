"""When a decision takes effect, where it is not after whole periods."""

from dataclasses import dataclass

from mjnav.errors import InvalidValue, unknown_name
from mjnav.scenarios.ranges import MAX_TIME, check_range

MODELS = ("sampled", "measured")
ORDERS = ("drawn", "recorded")


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
            check_range(f"trace.{i}", value, 0.0, MAX_TIME)
        if self.planned is not None:
            check_range("planned", self.planned, 0.0, MAX_TIME)
