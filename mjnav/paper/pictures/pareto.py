"""Every method over its own parameter: control cost and deviation against clearance, and collisions."""

from types import MappingProxyType

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mjnav.paper.contrast import Cells, short
from mjnav.paper.pareto import METHODS, curve, settings
from mjnav.paper.pictures.bars import color, legend, with_result
from mjnav.paper.pictures.style import TWO_COLUMNS, new_figure, style
from mjnav.study.compare.compare import estimate

FIGURES = MappingProxyType(
    {"control_cost": "control cost [m²/s³]", "mean_deviation_m": "deviation [m]", "collision": "collision rate"}
)


def figure(cells: Cells) -> Figure:
    """A column for each setting; up and left is better in neither: to the right and down is."""
    places = settings(cells)
    with style():
        figure = new_figure(TWO_COLUMNS, 0.7 + 1.7 * len(FIGURES))
        panels = figure.subplots(len(FIGURES), max(len(places), 1), sharex="col", sharey="row", squeeze=False)
        for row, (name, label) in zip(panels, FIGURES.items(), strict=True):
            for axes, place in zip(row, places, strict=False):
                for method in METHODS:
                    _curve(axes, cells, place, method, name)
            row[0].set_ylabel(label)
        for axes, place in zip(panels[0], places, strict=False):
            axes.set_title(f"{short(place)}, {with_result([cell for cell in cells if cell.setting == place])}")
        for axes in panels[-1]:
            axes.set_xlabel("mean of least clearance [m]")
        legend(figure, panels.flat, ncols=4)
    return figure


def _curve(axes: Axes, cells: Cells, setting: str, method: str, name: str) -> None:
    of_method = curve(cells, setting, method)
    if not of_method:
        return
    x = [estimate(cell, "min_clearance_m") for cell in of_method]
    y = [estimate(cell, name) for cell in of_method]
    order = np.argsort([e.value for e in x])
    shade = color(method)
    axes.plot(
        [x[i].value for i in order], [y[i].value for i in order], color=shade, marker="o", markersize=2.0, label=method
    )
    for i in order:
        if (interval := y[i].interval) is not None:
            axes.vlines(x[i].value, *interval, color=shade, linewidth=0.6, alpha=0.6)
    axes.grid()
