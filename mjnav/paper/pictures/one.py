"""One obstacle: cost, deviation and time to avoid of every method; the moment surrogate over the eta it asks for."""

from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells, by_place
from mjnav.paper.one import ETAS, RKHS, moments, tick_share
from mjnav.paper.pictures.bars import color, legend, with_result
from mjnav.paper.pictures.style import ORANGE, TWO_COLUMNS, new_figure, style
from mjnav.study.compare.compare import estimate

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
    every = (*METHODS, *map(moments, ETAS))
    places = list(dict.fromkeys(place for method in every for place in by_place(cells, method)))
    with style():
        figure = new_figure(max(TWO_COLUMNS, 0.95 * len(places)), 0.6 + 1.2 * len(FIGURES))
        panels = figure.subplots(len(FIGURES), max(len(places), 1), sharex=True, sharey="row", squeeze=False)
        for row, (name, label) in zip(panels, FIGURES.items(), strict=True):
            for axes, place in zip(row, places, strict=False):
                _panel(axes, cells, place, name)
            row[0].set_ylabel(label)
        for axes, place in zip(panels[0], places, strict=False):
            here = [by_place(cells, method)[place] for method in every if place in by_place(cells, method)]
            words = place.partition(", ")[2].replace(", ", " ").split(" ")
            axes.set_title("\n".join([*words, with_result(here)]), fontsize=6.0)
        for axes in panels[-1]:
            axes.set_xlabel("η")
        legend(figure, panels.flat, ncols=5)
    return figure


def _panel(axes: Axes, cells: Cells, place: str, name: str) -> None:
    found = [_estimate(cells, moments(eta), place, name) for eta in ETAS]
    middle = np.array([value for value, _ in found])
    axes.plot(ETAS, middle, color=ORANGE, marker="o", markersize=2.0, label="gaussian-moments over η")
    low, high = (np.array([interval[i] if interval else np.nan for _, interval in found]) for i in (0, 1))
    axes.fill_between(ETAS, low, high, color=ORANGE, alpha=0.25, linewidth=0.0)
    for method in METHODS:
        value, interval = _estimate(cells, method, place, name)
        if not np.isfinite(value):
            continue
        axes.axhline(value, color=color(method), label=method, linestyle="--" if "linearised" in method else "-")
        if interval:
            axes.axhspan(*interval, color=color(method), alpha=0.15, linewidth=0.0)
    axes.grid(axis="y")


def _estimate(cells: Cells, method: str, place: str, name: str) -> tuple[float, tuple[float, float] | None]:
    cell = by_place(cells, method).get(place)
    if cell is None:
        return np.nan, None
    if name == "infeasible":
        return 100.0 * tick_share(cell, "infeasible_ticks"), None
    found = estimate(cell, name)
    return found.value, found.interval
