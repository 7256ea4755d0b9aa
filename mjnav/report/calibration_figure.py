"""Reliability curves as a picture: what was predicted against what came to be, one panel a setting, one curve a method.

Below each panel stands how many decisions each bin holds. All shares are drawn by their square root: most risks are
small. Nothing here touches pyplot, so nothing is shared between figures.
"""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from mjnav.metrics.prediction import Calibration

PANEL = (4.6, 6.0)  # [inches]
LEGEND = 2.0  # [inches]
DPI = 120
TICKS = (0.0, 0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0)
MARKERS = "osD^v<>Pp*hX"


def calibration_figure(calibrations: Mapping[str, Mapping[str, Calibration]], title: str) -> Figure:
    """The picture of calibrations by method and setting; every method has the same settings."""
    settings = list(next(iter(calibrations.values())))
    figure = Figure(figsize=(PANEL[0] * len(settings) + LEGEND, PANEL[1]), dpi=DPI, layout="constrained")
    figure.suptitle(title, fontsize=12)
    grid = figure.subplots(2, len(settings), height_ratios=(3, 1), sharex=True, sharey="row", squeeze=False)
    for setting, curve, counts in zip(settings, *grid, strict=True):
        curve.set_title(setting, fontsize=11)
        curve.plot([0.0, 1.0], [0.0, 1.0], color="0.6", linestyle="--", linewidth=1.0, zorder=0)
        for i, (method, by_setting) in enumerate(calibrations.items()):
            errors = ", ".join("-" if c.ece is None else f"{c.ece:.3f}" for c in by_setting.values())
            _draw(curve, counts, by_setting[setting], f"{method}\n{errors}", i)
        _scale(curve, counts)
    grid[0, 0].set_ylabel("observed frequency, 95 % interval")
    grid[1, 0].set_ylabel("decisions")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, title="ECE by panel", loc="outside right upper", fontsize=9, labelspacing=1.0)
    return figure


def _draw(curve: Axes, counts: Axes, calibration: Calibration, label: str, i: int) -> None:
    bins = [b for b in calibration.bins if b.predicted is not None and b.observed is not None]
    colour, marker = to_rgba(f"C{i % 10}"), MARKERS[i % len(MARKERS)]
    x = np.array([b.predicted for b in bins], float)
    y = np.array([b.observed for b in bins], float)
    ends = np.array([b.observed_interval or (b.observed, b.observed) for b in bins], float).reshape(-1, 2)
    curve.plot(x, y, marker=marker, markersize=5, linewidth=1.2, color=colour, label=label, clip_on=False)
    curve.vlines(x, ends[:, 0], ends[:, 1], color=colour, linewidth=1.0, alpha=0.6, clip_on=False)
    counts.plot(x, [b.count for b in bins], marker=marker, markersize=4, linewidth=1.0, color=colour)


def _scale(curve: Axes, counts: Axes) -> None:
    """Square-root axes from 0 to 1, counts by their logarithm."""
    root = (lambda share: np.sqrt(np.maximum(share, 0.0)), np.square)
    curve.set_xscale("function", functions=root)
    curve.set_yscale("function", functions=root)
    curve.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0), xticks=TICKS, yticks=TICKS)
    counts.set_xticks(TICKS, [f"{tick:g}" for tick in TICKS])
    curve.set_yticks(TICKS, [f"{tick:g}" for tick in TICKS])
    counts.set(yscale="log", xlabel="predicted share of colliding samples", xlim=(0.0, 1.0))
    counts.set_ylim(bottom=0.8)
    for axes in (curve, counts):
        axes.grid(color="0.92", linewidth=0.7)
        axes.tick_params(labelsize=8)
        axes.minorticks_off()
