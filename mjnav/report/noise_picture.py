"""How well fitted laws go with recorded errors: quantiles against quantiles."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from mjnav.messages import Array
from mjnav.noise.correlated import DistributionFunction
from mjnav.noise.fit import Fit

MOST = 1000  # points of a curve


def quantile_figure(errors: Array, found: Sequence[Fit], column: str) -> Figure:
    """A curve of each law; on the diagonal the law has the quantiles of the errors (n,)."""
    figure = Figure(figsize=(5.0, 5.0), dpi=120, layout="constrained")
    axes = figure.subplots()
    shares = (np.arange(min(len(errors), MOST)) + 0.5) / min(len(errors), MOST)
    measured = np.quantile(errors, shares)
    for fit in found:
        label = f"{fit.name}, largest |F_n - F| {fit.distance:.3f}"
        axes.plot(DistributionFunction.of(fit.law).quantile(shares), measured, ".", markersize=3, label=label)
    ends = measured[[0, -1]]
    axes.plot(ends, ends, color="black", linewidth=0.8)
    axes.set(xlabel="quantiles of the law", ylabel=f"quantiles of the errors, {column}", title=f"{len(errors)} errors")
    axes.legend()
    return figure
