"""What the decisions were, and what they cost to compute."""

from collections.abc import Mapping
from types import MappingProxyType

from mjnav.metrics.definitions.definition import HIGHER, INTEGER, LOWER, Definition

_NEVER_MET = "never met an obstacle"

DECISIONS: Mapping[str, Definition] = MappingProxyType(
    {
        "infeasible_ticks": Definition(
            text="ticks at which nothing met the constraints: the sum of the next two", type=INTEGER, better=LOWER
        ),
        "ticks_without_nominal": Definition(
            text="status infeasible_nominal: nothing met the constraints at the mean of the samples",
            type=INTEGER, better=LOWER,
        ),
        "ticks_without_own": Definition(
            text="status infeasible: candidates met those, none the method's own constraint", type=INTEGER, better=LOWER
        ),
        "stopped_ticks": Definition(text="ticks of status stopped", type=INTEGER),
        "clipped_ticks": Definition(
            text="ticks whose decision was beyond the robot's limits; the command within them counts", type=INTEGER
        ),
        "cautious_ticks": Definition(
            text="ticks at which the robot drove more slowly than decided, or stopped, as it did not know enough",
            type=INTEGER,
        ),
        "min_safe_share": Definition(
            text="share of the closest obstacle's samples that are safe at the chosen control, minimum over ticks",
            better=HIGHER, words="least share of safe samples", null=_NEVER_MET, equation=r"f \le 0",
        ),
        "mean_safe_share": Definition(
            text="the same, mean over ticks",
            better=HIGHER, words="mean share of safe samples", null=_NEVER_MET,
        ),
    }
)  # fmt: skip

_PHASES = MappingProxyType(
    {
        "sense": "the sensors' readings",
        "estimate": "the filters and the prediction",
        "control": "a decision of the controller",
        "record": "the record of the tick, the log included",
        "tick": "a whole tick, physics included",
    }
)
_QUANTILES = MappingProxyType(
    {"p50": "median over ticks", "p99": "99 % of ticks are below", "max": "the longest of all ticks"}
)

COMPUTING: Mapping[str, Definition] = MappingProxyType(
    {
        **{
            f"compute_ms_{phase}_{level}": Definition(
                text=f"wall time of {what}; {quantile}", unit="ms", better=LOWER, null="no ticks"
            )
            for phase, what in _PHASES.items()
            for level, quantile in _QUANTILES.items()
        },
        "real_time_factor": Definition(
            text="simulated time over wall time, from tick 0 on", better=HIGHER, null="no time passed"
        ),
        "deadline_misses": Definition(
            text="ticks that ended after the next was due; 0 where the run was not paced", type=INTEGER, better=LOWER
        ),
    }
)
