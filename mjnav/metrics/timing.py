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
    return {name: _quantiles(values) for name, values in {**columns, "tick": phases.sum(-1)}.items()}


def _quantiles(values: NDArray[np.float64]) -> dict[str, float | None]:
    if not values.size:
        return {"p50": None, "p99": None, "max": None}
    p50, p99 = np.quantile(values, [0.5, 0.99]).tolist()
    return {"p50": p50, "p99": p99, "max": float(values.max())}
