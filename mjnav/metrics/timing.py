"""How long a tick took."""

import numpy as np
from numpy.typing import NDArray

from mjnav.messages import PHASES

REPORTED = ("sense", "estimate", "control", "record")


def compute_ms(timing: NDArray[np.int64]) -> dict[str, dict[str, float | None]]:
    """Median, 99 % quantile and maximum of the time by phase and of the whole tick, physics included [ms].

    `timing` (T, 7) is a trajectory's: tick, PHASES, lateness [ns]. None where there is no tick.
    """
    phases = timing[:, 1 : 1 + len(PHASES)] * 1e-6
    columns = {name: phases[:, PHASES.index(name)] for name in REPORTED}
    return {name: quantiles(values) for name, values in {**columns, "tick": phases.sum(-1)}.items()}


def quantiles(values: NDArray[np.floating] | NDArray[np.integer], **more: float) -> dict[str, float | None]:
    """p50, p99, `more` by name, and max of values (n,). None where there is none."""
    levels = {"p50": 0.5, "p99": 0.99, **more}
    if not values.size:
        return dict.fromkeys((*levels, "max"))
    found = np.quantile(values, list(levels.values())).tolist()
    return {**dict(zip(levels, found, strict=True)), "max": float(values.max())}
