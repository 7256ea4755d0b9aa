"""Figures that were taken many times a run: decisions of one run resemble one another, so whole runs are resampled."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.metrics.intervals import SharedBootstrap, paired_bootstrap
from mjnav.rng import stream
from mjnav.study.compare.compare import Difference, Estimate

LEAST_RUNS = 5  # fewer make no interval


def mean_by_run(run: ArrayLike, values: ArrayLike, seed: int, use: str, *, boundary: float = 0.0) -> Difference:
    """The mean over runs of each run's mean of `values` (n,), of runs `run` (n,), with its 95 % interval.

    The p-value, of sign flips, is that of the mean being the boundary. The draws are those of the seed and the use.
    """
    run, values = np.asarray(run), np.asarray(values, float)
    means = np.array([values[run == one].mean() for one in np.unique(run)])
    interval, p = None, None
    if len(means) >= LEAST_RUNS:
        interval = paired_bootstrap(means, np.zeros_like(means), stream(seed, f"paper.{use}.bootstrap"))
        (p,) = SharedBootstrap(len(means), stream(seed, f"paper.{use}.flips")).p_values((means - boundary)[None])
    return Difference(Estimate(float(means.mean()), interval, len(means)), p)
