"""Figures that were taken many times a run: decisions of one run resemble one another, so whole runs are resampled."""

import numpy as np
from numpy.typing import ArrayLike

from mjnav.metrics.intervals import paired_bootstrap
from mjnav.rng import stream
from mjnav.study.compare import Estimate

LEAST_RUNS = 5  # fewer make no interval


def mean_by_run(run: ArrayLike, values: ArrayLike, seed: int, use: str) -> Estimate:
    """The mean over runs of each run's mean of `values` (n,), of runs `run` (n,), with its 95 % interval.

    The draws are those of the seed and the use.
    """
    run, values = np.asarray(run), np.asarray(values, float)
    means = np.array([values[run == one].mean() for one in np.unique(run)])
    interval = None
    if len(means) >= LEAST_RUNS:
        interval = paired_bootstrap(means, np.zeros_like(means), stream(seed, f"paper.{use}.bootstrap"))
    return Estimate(float(means.mean()), interval, len(means))
