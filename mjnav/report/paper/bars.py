"""Methods side by side in every setting: a bar a method, as the paper has them, with the intervals that it lacks."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from mjnav.report.paper.style import DEGREES, GREY, INK, METHODS, TWO_COLUMNS, new_figure, style
from mjnav.study.paper.contrast import Cells, by_place, values

ROW_HEIGHT = 1.25  # [inches]


def bars(
    cells: Cells, methods: Sequence[str], figures: Mapping[str, str], *, colors: Mapping[str, str] | None = None
) -> Figure:
    """A row of panels for each of `figures` (column -> axis label), a panel for each scene and setting.

    Bars are means (rates: shares), whiskers 95 % intervals over seeds.
    """
    places = list(dict.fromkeys(place for method in methods for place in by_place(cells, method)))
    colors = colors or {method: color(method) for method in methods}
    width = max(TWO_COLUMNS, 0.95 * len(places))
    with style():
        figure = new_figure(width, 0.6 + ROW_HEIGHT * len(figures))
        panels = figure.subplots(len(figures), max(len(places), 1), sharex=True, sharey="row", squeeze=False)
        for row, (name, label) in zip(panels, figures.items(), strict=True):
            found = {method: values(cells, method, name) for method in methods}
            for axes, place in zip(row, places, strict=False):
                _panel(axes, [found[method].get(place) for method in methods], [colors[m] for m in methods])
            row[0].set_ylabel(label)
        for axes, place in zip(panels[0], places, strict=False):
            axes.set_title(place.replace(", ", "\n").replace(" ", "\n"), fontsize=6.0)
        handles = [Patch(facecolor=colors[method], label=method) for method in methods]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(len(methods), 6))
    return figure


def _panel(axes: Axes, found: Sequence, colors: Sequence[str]) -> None:
    for x, (estimate, shade) in enumerate(zip(found, colors, strict=True)):
        if estimate is None or not np.isfinite(estimate.value):
            axes.annotate("–", (x, 0.0), ha="center", va="bottom", color=GREY)
            continue
        axes.bar(x, estimate.value, width=0.8, color=shade)
        if estimate.interval is not None:
            axes.vlines(x, *estimate.interval, color=INK, linewidth=0.7)
    axes.set_xticks([])
    axes.margins(x=0.05)
    axes.grid(axis="y")


def color(label: str) -> str:
    """Of a method's label: a degree's own shade, else the method's."""
    for degree, shade in DEGREES.items():
        if f"d={degree}" in label:
            return shade
    return next((shade for name, shade in METHODS.items() if label.startswith(name)), INK)
