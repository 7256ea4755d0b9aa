"""One obstacle: cost, deviation and time to avoid of every method; the moment surrogate over the eta it asks for."""

from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.report.paper.bars import color
from mjnav.report.paper.style import ORANGE, TWO_COLUMNS, new_figure, style
from mjnav.study.paper.contrast import Cells, by_place, values
from mjnav.study.paper.one import ETAS, RKHS, moments

METHODS = (*RKHS, "gaussian-linearised")
FIGURES = MappingProxyType(
    {
        "control_cost": "control cost\n[m²/s³]",
        "mean_deviation_m": "deviation [m]",
        "time_to_avoid_s": "time to avoid [s]",
        "infeasible": "infeasible\nticks [%]",
    }
)


def figure(cells: Cells) -> Figure:
    """A column for each setting: the moment surrogate as a curve over eta, the others as lines across."""
    places = list(by_place(cells, RKHS[0]))
    with style():
        figure = new_figure(max(TWO_COLUMNS, 0.95 * len(places)), 0.6 + 1.2 * len(FIGURES))
        panels = figure.subplots(len(FIGURES), max(len(places), 1), sharex=True, sharey="row", squeeze=False)
        for row, (name, label) in zip(panels, FIGURES.items(), strict=True):
            for axes, place in zip(row, places, strict=False):
                _panel(axes, cells, place, name)
            row[0].set_ylabel(label)
        for axes, place in zip(panels[0], places, strict=False):
            axes.set_title(place.partition(", ")[2].replace(", ", "\n").replace(" ", "\n"), fontsize=6.0)
        for axes in panels[-1]:
            axes.set_xlabel("η")
        handles, labels = panels[0][0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=5)
    return figure


def _panel(axes: Axes, cells: Cells, place: str, name: str) -> None:
    found = [_estimate(cells, moments(eta), place, name) for eta in ETAS]
    middle = np.array([value for value, _ in found])
    axes.plot(ETAS, middle, color=ORANGE, marker="o", markersize=2.0, label="gaussian-moments over η")
    low, high = (np.array([interval[i] if interval else np.nan for _, interval in found]) for i in (0, 1))
    axes.fill_between(ETAS, low, high, color=ORANGE, alpha=0.25, linewidth=0.0)
    for method in METHODS:
        value, interval = _estimate(cells, method, place, name)
        axes.axhline(value, color=color(method), label=method, linestyle="--" if "linearised" in method else "-")
        if interval:
            axes.axhspan(*interval, color=color(method), alpha=0.15, linewidth=0.0)
    axes.grid(axis="y")


def _estimate(cells: Cells, method: str, place: str, name: str) -> tuple[float, tuple[float, float] | None]:
    if name == "infeasible":
        cell = by_place(cells, method)[place]
        return 100.0 * float(cell.columns["infeasible_ticks"].sum() / cell.columns["ticks"].sum()), None
    estimate = values(cells, method, name)[place]
    return estimate.value, estimate.interval
